#pragma once

#include <cassert>
#include <type_traits>

namespace xplane_bridge::core {

/// A value, or the enumerated reason why there is none. Never throws, never allocates.
/// T must be default-constructible; a zero E means "no error".
template <typename T, typename E>
class Result {
  static_assert(std::is_enum_v<E>, "the reason is an enumeration whose zero means no error");

 public:
  constexpr Result(const T& value) : value_(value) {}  // NOLINT(google-explicit-constructor)
  constexpr Result(E error) : error_(error) {          // NOLINT(google-explicit-constructor)
    assert(error != E{});
  }

  constexpr bool ok() const { return error_ == E{}; }
  constexpr explicit operator bool() const { return ok(); }
  /// The reason; E{} when there is a value.
  constexpr E error() const { return error_; }

  /// The value. Only when ok().
  constexpr const T& value() const {
    assert(ok());
    return value_;
  }
  constexpr const T& operator*() const { return value(); }
  constexpr const T* operator->() const { return &value(); }

 private:
  T value_{};
  E error_{};
};

}  // namespace xplane_bridge::core
