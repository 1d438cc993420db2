#pragma once

/// What the measuring programs share: settings from the command line, the steady clock, percentiles.

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <ctime>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

namespace xplane_bridge::bench {

/// `key=value` words.
class Settings {
 public:
  Settings(int argc, char** argv) {
    for (int i = 1; i < argc; ++i) {
      const std::string word = argv[i];
      const std::size_t equals = word.find('=');
      if (equals == std::string::npos) throw std::invalid_argument("expected key=value, given " + word);
      values_[word.substr(0, equals)] = word.substr(equals + 1);
    }
  }

  /// Empty where it is not given.
  std::string text(const std::string& key) const {
    const auto found = values_.find(key);
    return found == values_.end() ? "" : found->second;
  }
  /// 0 where it is not given.
  double number(const std::string& key) const {
    const std::string value = text(key);
    return value.empty() ? 0.0 : std::stod(value);
  }
  std::uint16_t port(const std::string& key) const { return static_cast<std::uint16_t>(number(key)); }

 private:
  std::map<std::string, std::string> values_;
};

inline std::int64_t now_ns() {
  timespec t{};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return std::int64_t{t.tv_sec} * 1'000'000'000 + t.tv_nsec;
}

inline void sleepUntil(std::int64_t time_ns) {
  const timespec t{time_ns / 1'000'000'000, time_ns % 1'000'000'000};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, nullptr) == EINTR) {
  }
}

/// -1 without values.
inline double percentile(std::vector<double> values, double share) {
  if (values.empty()) return -1.0;
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

}  // namespace xplane_bridge::bench
