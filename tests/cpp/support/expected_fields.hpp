#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "message_fields.hpp"

/// Messages held to what is expected of them field by field, so that two fields swapped, and one that was forgotten,
/// are noticed: each field must be expected, and none may have the numbers of another.
namespace xplane_bridge {

/// Most conversions leave the header to those who publish.
inline std::set<std::string> headerAnd(std::set<std::string> others) {
  others.insert({"header.seq", "header.stamp", "header.frame_id"});
  return others;
}

/// Flags cannot differ in one message; over kPasses messages each of the first seven has a pattern of its own.
constexpr unsigned kPasses = 3;
inline bool flag(std::size_t number, unsigned pass) { return ((number + 1) >> pass & 1U) != 0; }

/// Every number of the message against its expected value, and every one of these against all others.
inline void expectFields(const MessageLayout& layout, const MessageValues& actual, const MessageValues& expected,
                         const std::set<std::string>& not_distinct = {}) {
  std::map<std::vector<double>, std::string> seen;
  for (const std::string& name : layout.fields()) {
    const MessageLeaf& leaf = layout.leaf(name);
    if (leaf.type == "string" || name == "header.seq") continue;
    SCOPED_TRACE(name);
    const auto want = expected.find(name);
    if (want == expected.end()) {
      ADD_FAILURE() << "nothing was expected of it: a field that is computed is to be expected here";
      continue;
    }
    const std::vector<double>& values = actual.at(name);
    ASSERT_LE(want->second.size(), values.size());
    const bool single = leaf.type == "float32";
    for (std::size_t i = 0; i < values.size(); ++i) {
      const double value = i < want->second.size() ? want->second[i] : std::nan("");
      if (std::isnan(value)) {
        EXPECT_TRUE(std::isnan(values[i])) << "[" << i << "] is " << values[i] << ", expected nothing there";
      } else {
        EXPECT_NEAR(values[i], value, std::abs(value) * (single ? 1e-7 : 1e-12) + 1e-9) << "[" << i << "]";
      }
    }
    if ((leaf.type == "bool" && !leaf.is_list) || not_distinct.count(name) != 0) continue;
    const auto [other, is_new] = seen.try_emplace(want->second, name);
    EXPECT_TRUE(is_new) << "has the same number as " << other->second << ": swapping them would not be noticed";
  }
}

/// The same of its texts.
inline void expectTexts(const MessageLayout& layout, const MessageTexts& actual, const MessageTexts& expected,
                        const std::set<std::string>& not_distinct = {}) {
  std::map<std::vector<std::string>, std::string> seen;
  for (const std::string& name : layout.fields()) {
    if (layout.leaf(name).type != "string") continue;
    SCOPED_TRACE(name);
    const auto want = expected.find(name);
    if (want == expected.end()) {
      ADD_FAILURE() << "nothing was expected of it";
      continue;
    }
    EXPECT_EQ(actual.at(name), want->second);
    if (not_distinct.count(name) != 0) continue;
    const auto [other, is_new] = seen.try_emplace(want->second, name);
    EXPECT_TRUE(is_new) << "has the same text as " << other->second << ": swapping them would not be noticed";
  }
}

/// Numbers and texts of a message.
/// @param untouched fields that must be as in a new message: others fill them
template <class Message>
void expectMessage(const Message& message, MessageContent expected, const std::set<std::string>& untouched = {}) {
  const MessageLayout layout = MessageLayout::of<Message>();
  const MessageContent actual = layout.content(message), empty = layout.content(Message());
  for (const std::string& name : untouched) {
    if (layout.leaf(name).type == "string") {
      EXPECT_TRUE(expected.texts.emplace(name, empty.texts.at(name)).second) << name;
    } else {
      EXPECT_TRUE(expected.values.emplace(name, empty.values.at(name)).second) << name;
    }
  }
  for (const auto& [name, values] : expected.values) {  // of a list all, also what is too much
    if (layout.leaf(name).is_list) {
      EXPECT_EQ(actual.values.at(name).size(), values.size()) << name;
    }
  }
  expectFields(layout, actual.values, expected.values, untouched);
  expectTexts(layout, actual.texts, expected.texts, untouched);
}

/// A message in which every field has numbers of its own, whole and below 256, and every text is its field's name. It
/// remembers which of them were asked for.
template <class Message>
class FilledMessage {
 public:
  /// @param chosen numbers of fields that must make sense
  explicit FilledMessage(unsigned pass = 0, const MessageValues& chosen = {}) {
    std::size_t flags = 0;
    int last = 10;
    for (const MessageLeaf& leaf : layout_.leaves()) {
      const auto given = chosen.find(leaf.field);
      for (std::size_t i = 0; i < (leaf.is_list ? kListed : 1U); ++i) {
        std::vector<double>& values = values_[leaf.field];
        if (leaf.type == "string") {
          texts_[leaf.field].push_back(leaf.field + (leaf.is_list ? std::to_string(i) : ""));
        } else if (given != chosen.end()) {
          values.push_back(given->second.at(values.size()));
        } else {
          values.push_back(leaf.type == "bool" ? (flag(flags++, pass) ? 1.0 : 0.0) : ++last);
        }
      }
    }
    EXPECT_LT(last, 256) << "too many fields for a number of each that fits every type";
    message_ = layout_.make<Message>(values_, texts_);
  }

  const Message& message() const { return message_; }
  const MessageLayout& layout() const { return layout_; }
  double number(const std::string& field) { return numbers(field).at(0); }
  const std::vector<double>& numbers(const std::string& field) {
    asked_.insert(field);
    return values_.at(field);
  }
  std::string text(const std::string& field) {
    asked_.insert(field);
    return texts_.at(field).at(0);
  }
  /// Fields that the test has not asked for, without the header's.
  std::set<std::string> unasked() const {
    std::set<std::string> out;
    for (const std::string& field : layout_.fields()) {
      if (asked_.count(field) == 0 && field.rfind("header.", 0) != 0) out.insert(field);
    }
    return out;
  }
  /// The same with one element more in a list.
  Message withLonger(const std::string& list) const {
    MessageValues values = values_;
    values.at(list).push_back(0.0);
    return layout_.make<Message>(values, texts_);
  }

 private:
  static constexpr std::size_t kListed = 2;

  MessageLayout layout_ = MessageLayout::of<Message>();
  MessageValues values_;
  MessageTexts texts_;
  std::set<std::string> asked_;
  Message message_;
};

}  // namespace xplane_bridge
