#include "xplane_bridge/nodes/tx/tx_lockstep.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace xplane_bridge {
namespace {

/// Frame k is stamped 1000 + k seconds; there is one participant.
class TxLockstepTest : public testing::Test {
 protected:
  static ros::Time stamp(std::uint32_t frame) { return {1000U + frame, 0U}; }

  void open(std::uint32_t frame) {
    core::LockstepFrame each;
    each.number = frame;
    lockstep_.open(each, stamp(frame));
  }
  void request(const std::string& who, std::uint32_t frame, int topic, const std::string& what) {
    lockstep_.takeRequest(who, stamp(frame), topic, [this, what] { done_.push_back(what); });
  }
  /// What is carried out at the end of the present frame.
  std::vector<std::string> close() {
    done_.clear();
    lockstep_.close();
    return done_;
  }
  std::vector<std::string> fly(std::uint32_t frame) {
    open(frame);
    return close();
  }

  static LockstepOptions options() {
    LockstepOptions out;
    out.participants = {"player"};
    return out;
  }

  using Texts = std::vector<std::string>;

  std::vector<std::string> done_;
  TxLockstep lockstep_{options(), core::hostClock(), stamp(0), [] {}, [](const std::string&) {}};
};

TEST_F(TxLockstepTest, ARequestIsCarriedOutInTheSecondFrameAfterItsOwnWheneverItComes) {
  fly(1);
  open(2);
  request("/player", 2, 0, "in time");
  EXPECT_EQ(close(), Texts{});
  open(3);
  request("/player", 2, 0, "late");
  EXPECT_EQ(close(), Texts{});
  open(4);
  request("/player", 2, 0, "later");
  EXPECT_EQ(close(), (Texts{"in time", "late", "later"}));
  EXPECT_EQ(fly(5), Texts{});
}

TEST_F(TxLockstepTest, RequestsThatAreDueTogetherHaveAnOrderOfTheirOwn) {
  fly(1);
  open(2);
  request("/stranger", 2, 0, "stranger");
  request("/player", 2, 1, "traffic");
  request("/player", 2, 0, "mode");
  request("/player", 1, 1, "before");
  EXPECT_EQ(close(), Texts{});
  EXPECT_EQ(fly(3), Texts{"before"});
  EXPECT_EQ(fly(4), (Texts{"mode", "traffic", "stranger"}));
}

TEST_F(TxLockstepTest, ARequestAnswersNoFrame) {
  open(1);
  request("/player", 1, 0, "mode");
  lockstep_.takeDone("/rx_node", stamp(1), "");
  EXPECT_FALSE(lockstep_.ready());
  lockstep_.takeDone("/player", stamp(1), "");
  EXPECT_TRUE(lockstep_.ready());
}

}  // namespace
}  // namespace xplane_bridge
