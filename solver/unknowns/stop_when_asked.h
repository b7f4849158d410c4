// SPDX-License-Identifier: MIT
#pragma once

#include <functional>

#include <ceres/iteration_callback.h>

namespace holdfast {

/// Tells how far a solve of Ceres is, as (iteration, `most`), and ends it when `progress` returns
/// false; without one, the solve goes on. `progress` must outlive it.
class StopWhenAsked final : public ceres::IterationCallback {
 public:
  StopWhenAsked(const std::function<bool(int, int)>& progress, int most)
      : progress_(progress), most_(most) {}
  ceres::CallbackReturnType operator()(const ceres::IterationSummary& summary) override {
    return !progress_ || progress_(summary.iteration, most_) ? ceres::SOLVER_CONTINUE
                                                             : ceres::SOLVER_ABORT;
  }

 private:
  const std::function<bool(int, int)>& progress_;
  int most_;
};

}  // namespace holdfast
