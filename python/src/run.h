// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <future>
#include <memory>
#include <type_traits>
#include <utility>

#include <pybind11/pybind11.h>

#include "geometry/parallel.h"

namespace holdfast::python {

namespace py = pybind11;

/// Runs `work` on a thread of its own, without the interpreter's lock, while this one looks for
/// Ctrl-C. `work` is to stop when the progress it is given returns false; so does every ParallelFor
/// in it (StopOn). `progress` is None or a
/// callable (stage, done, total); False from it stops the work too. What it raises, and
/// KeyboardInterrupt, is raised here when the work has stopped; so is what `work` throws, and
/// Stopped after False.
void RunWithProgress(const py::object& progress,
                     const std::function<void(const StagedProgress&)>& work);

/// Runs `work` on a thread of its own, without the interpreter's lock. On Ctrl-C the caller goes on
/// with KeyboardInterrupt, and the work is left to end by itself; the interpreter waits for it
/// before it exits.
void LeaveOnInterrupt(std::function<void()> work);

/// What `work` returns, or throws: for work that cannot be stopped half way. It must own all that
/// it uses, and nothing of Python's, since Ctrl-C ends this call and not the work.
template <typename Work>
auto RunAside(Work work) {
  using Result = std::invoke_result_t<Work&>;
  const auto task = std::make_shared<std::packaged_task<Result()>>(std::move(work));
  std::future<Result> result = task->get_future();
  LeaveOnInterrupt([task] { (*task)(); });
  return result.get();
}

/// Waits at exit for what LeaveOnInterrupt has left.
void BindRun();

/// Threads to use for the argument `threads`: 0 means all that the process may use.
int ThreadsOf(int threads);

}  // namespace holdfast::python
