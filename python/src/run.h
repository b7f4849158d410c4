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

/// Runs `work` on a separate thread without the interpreter lock, while this thread checks for
/// Ctrl-C. `work` has to stop when its progress callback returns false; ParallelFor inside it stops
/// as well (StopOn). `progress` is None or a callable (stage, done, total); if it returns False,
/// the work stops too. Exceptions of `progress` and KeyboardInterrupt are raised here after the
/// work has stopped, as are exceptions of `work`, and Stopped after False.
void RunWithProgress(const py::object& progress,
                     const std::function<void(const StagedProgress&)>& work);

/// Runs `work` on a separate thread without the interpreter lock. On Ctrl-C this call raises
/// KeyboardInterrupt and the work continues in the background; the interpreter waits for it at
/// exit.
void LeaveOnInterrupt(std::function<void()> work);

/// Returns the result of `work`, or throws its exception, for work that cannot be stopped. `work`
/// must own everything it uses, and no Python objects, since Ctrl-C ends this call but not the
/// work.
template <typename Work>
auto RunAside(Work work) {
  using Result = std::invoke_result_t<Work&>;
  const auto task = std::make_shared<std::packaged_task<Result()>>(std::move(work));
  std::future<Result> result = task->get_future();
  LeaveOnInterrupt([task] { (*task)(); });
  return result.get();
}

/// Makes the interpreter wait at exit for work left by LeaveOnInterrupt.
void BindRun();

/// Returns the number of threads for the argument `threads`; 0 means all available to the process.
int ThreadsOf(int threads);

}  // namespace holdfast::python
