// SPDX-License-Identifier: MIT
#pragma once

#include <stdexcept>
#include <string>
#include <string_view>

namespace holdfast {

/// The exception thrown for invalid input: where the problem is (a path, a field), what it is, and
/// its remedy. `what()` is "<where>: <problem>. <remedy>". Programming errors assert; numerical
/// problems are a status in a report; only invalid input throws.
class Error : public std::runtime_error {
 public:
  Error(std::string_view where, std::string_view problem, std::string_view remedy);

  const std::string& Where() const noexcept { return where_; }
  const std::string& Problem() const noexcept { return problem_; }
  const std::string& Remedy() const noexcept { return remedy_; }

 private:
  std::string where_;
  std::string problem_;
  std::string remedy_;
};

/// The input is valid, but there is no result: no grasp, no contact. The program ends with exit
/// code 3. The text names options as on the command line ("--hand").
class FitFailure : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Returns the result of `work`. An Error with location `what` ("mesh", "the clip") is rethrown
/// with location `source`.
template <typename Work>
auto NamingSource(std::string_view what, const std::string& source, const Work& work) {
  try {
    return work();
  } catch (const Error& error) {
    if (error.Where() != what) throw;
    throw Error(source, error.Problem(), error.Remedy());
  }
}

}  // namespace holdfast
