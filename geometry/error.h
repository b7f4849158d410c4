// SPDX-License-Identifier: MIT
#pragma once

#include <stdexcept>
#include <string>
#include <string_view>

namespace holdfast {

/// The one exception of the library: where the fault is (a path, a field), what was found there,
/// and what to do about it. `what()` reads "<where>: <problem>. <remedy>". Programming errors
/// assert; numerical trouble is a status in a report; only faults of the input throw.
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

/// The input is sound, yet there is no result: no grasp, no contact. The program ends with exit
/// code 3. The text names options as the command line does ("--hand").
class FitFailure : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// What `work` gives; an Error of it about `what` ("mesh", "the clip") is thrown on as one about
/// `source`.
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
