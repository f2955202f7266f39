/// A value, or one Error a person can act on. (std::expected is C++23; g++ 12 does not have it in C++20.)
#pragma once

#include <string>
#include <utility>
#include <variant>

namespace lichthof {

/// What a caller may react to; the exit status of the program follows from it.
enum class ErrorCode {
  bad_input,     ///< the user's file, option or line is wrong: exit status 2
  io,            ///< reading or writing failed: exit status 1
  failed,        ///< the job itself failed: exit status 1
  interrupted,   ///< stopped by SIGINT or SIGTERM: exit status 1, what was reached is kept
};

struct Error {
  ErrorCode code = ErrorCode::failed;
  std::string where;    ///< file:line, option name or peer; empty where there is none
  std::string message;  ///< what is wrong, what was expected, how to mend it; one line
  std::string text() const { return where.empty() ? message : where + ": " + message; }
};

template <class T>
class [[nodiscard]] Expected {
 public:
  Expected(T value) : state_(std::in_place_index<0>, std::move(value)) {}
  Expected(Error error) : state_(std::in_place_index<1>, std::move(error)) {}

  explicit operator bool() const { return state_.index() == 0; }
  T& operator*() { return std::get<0>(state_); }
  const T& operator*() const { return std::get<0>(state_); }
  T* operator->() { return &std::get<0>(state_); }
  const T* operator->() const { return &std::get<0>(state_); }
  Error& error() { return std::get<1>(state_); }
  const Error& error() const { return std::get<1>(state_); }

 private:
  std::variant<T, Error> state_;
};

/// Success without a value.
struct Done {};
using Status = Expected<Done>;

}  // namespace lichthof
