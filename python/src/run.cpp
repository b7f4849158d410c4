// SPDX-License-Identifier: MIT
#include "python/src/run.h"

#include <atomic>
#include <chrono>
#include <exception>
#include <future>
#include <memory>
#include <utility>
#include <vector>

#include "geometry/parallel.h"
#include "python/src/bindings.h"

namespace holdfast::python {
namespace {

// Work left running after Ctrl-C; accessed only with the interpreter lock held.
std::vector<std::future<void>>& LeftBehind() {
  static std::vector<std::future<void>> left;
  return left;
}

}  // namespace

void LeaveOnInterrupt(std::function<void()> work) {
  const auto stop = std::make_shared<std::atomic<bool>>(false);
  std::future<void> done = std::async(std::launch::async, [work = std::move(work), stop] {
    const StopOn interrupt(stop.get());
    work();
  });
  {
    const py::gil_scoped_release unlocked;
    while (!*stop && done.wait_for(std::chrono::milliseconds(20)) != std::future_status::ready) {
      const py::gil_scoped_acquire lock;
      if (PyErr_CheckSignals() != 0) *stop = true;
    }
  }
  if (!*stop) return;
  std::erase_if(LeftBehind(), [](const std::future<void>& work_before) {
    return work_before.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
  });
  LeftBehind().push_back(std::move(done));
  throw py::error_already_set();
}

void BindRun() {
  py::module_::import("atexit").attr("register")(py::cpp_function([] {
    std::vector<std::future<void>> left = std::move(LeftBehind());
    const py::gil_scoped_release unlocked;
    left.clear();
  }));
}

void RunWithProgress(const py::object& progress,
                     const std::function<void(const StagedProgress&)>& work) {
  if (!progress.is_none() && PyCallable_Check(progress.ptr()) == 0) {
    throw py::type_error("progress: expected None or a callable (stage, done, total)");
  }
  std::atomic<bool> stop{false};
  std::exception_ptr raised;  // by the callback; accessed with the lock held
  const bool calls = !progress.is_none();
  const StagedProgress watched = [&](const char* stage, int done, int total) {
    if (stop) return false;
    if (!calls) return true;
    const py::gil_scoped_acquire lock;
    if (raised) return false;
    try {
      const py::object answer = progress(stage, done, total);
      if (!answer.is_none() && PyObject_IsTrue(answer.ptr()) == 0) stop = true;
    } catch (...) {
      raised = std::current_exception();
      stop = true;
    }
    return !stop.load();
  };
  bool interrupted = false;
  std::exception_ptr failed;
  {
    const py::gil_scoped_release unlocked;
    auto done = std::async(std::launch::async, [&] {
      const StopOn told(&stop);
      work(watched);
    });
    while (done.wait_for(std::chrono::milliseconds(interrupted ? 1000 : 20)) !=
           std::future_status::ready) {
      if (interrupted) continue;
      const py::gil_scoped_acquire lock;
      if (PyErr_CheckSignals() != 0) stop = interrupted = true;
    }
    try {
      done.get();
    } catch (const WorkStopped&) {
    } catch (...) {
      failed = std::current_exception();
    }
  }
  if (interrupted) throw py::error_already_set();
  if (raised) std::rethrow_exception(std::exchange(raised, nullptr));
  if (failed) std::rethrow_exception(failed);
  if (stop) throw Stopped();
}

int ThreadsOf(int threads) {
  if (threads < 0) throw py::value_error("threads: expected 0 (all) or more");
  return threads == 0 ? AvailableThreads() : threads;
}

}  // namespace holdfast::python
