// SPDX-License-Identifier: MIT
// Times loading body models, and building all their vertices:
//   body_model_load FILE...
// tests/bench/make_full_size_models.py writes files of SMPL-X's full size. Best of five,
// milliseconds; "CPU" sums over threads.
#include <algorithm>
#include <chrono>
#include <ctime>
#include <limits>

#include <fmt/format.h>

#include "geometry/body/body_model.h"
#include "geometry/error.h"

int main(int argc, char** argv) {
  if (argc < 2) {
    fmt::print(stderr, "usage: body_model_load FILE...\n");
    return 2;
  }
  using Clock = std::chrono::steady_clock;
  const auto ms = [](Clock::time_point from, Clock::time_point to) {
    return std::chrono::duration<double, std::milli>(to - from).count();
  };
  try {
    fmt::print(
        "| file | load | load (CPU) | hand, ten betas | all vertices | one pose |\n"
        "|---|---|---|---|---|---|\n");
    for (int i = 1; i < argc; ++i) {
      double best[5];
      std::ranges::fill(best, std::numeric_limits<double>::infinity());
      for (int round = 0; round < 5; ++round) {
        const std::clock_t busy = std::clock();
        const auto t0 = Clock::now();
        const auto model = holdfast::BodyModel::Load(argv[i]);
        const auto t1 = Clock::now();
        const double cpu = 1e3 * static_cast<double>(std::clock() - busy) / CLOCKS_PER_SEC;
        const Eigen::VectorXd betas = Eigen::VectorXd::Ones(std::min(10, model->NumShape()));
        const holdfast::BodySurface hand(
            model, betas, model->HandVertexIds(model->LoneHand().value_or(holdfast::Side::kRight)));
        const auto t2 = Clock::now();
        const holdfast::BodySurface whole(model, betas);
        const auto t3 = Clock::now();
        holdfast::BodyState state;
        holdfast::Forward(whole, 0.1 * holdfast::JointPose::Ones(), Eigen::Vector3d::Zero(), state);
        const auto t4 = Clock::now();
        const double took[] = {ms(t0, t1), cpu, ms(t1, t2), ms(t2, t3), ms(t3, t4)};
        for (int k = 0; k < 5; ++k) best[k] = std::min(best[k], took[k]);
      }
      fmt::print("| {} | {:.0f} | {:.0f} | {:.0f} | {:.0f} | {:.1f} |\n", argv[i], best[0], best[1],
                 best[2], best[3], best[4]);
    }
  } catch (const holdfast::Error& error) {
    fmt::print(stderr, "body_model_load: {}\n", error.what());
    return 1;
  }
  return 0;
}
