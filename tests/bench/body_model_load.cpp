// SPDX-License-Identifier: MIT
// Times loading body models, and building all their vertices:
//   body_model_load FILE...
// tests/bench/make_full_size_models.py writes files of SMPL-X's full size. Best of five,
// milliseconds.
#include <algorithm>
#include <ctime>
#include <limits>

#include <fmt/format.h>

#include "geometry/body_model.h"
#include "geometry/error.h"

int main(int argc, char** argv) {
  if (argc < 2) {
    fmt::print(stderr, "usage: body_model_load FILE...\n");
    return 2;
  }
  const auto ms = [](std::clock_t from, std::clock_t to) {
    return 1e3 * static_cast<double>(to - from) / CLOCKS_PER_SEC;
  };
  try {
    fmt::print(
        "| file | load | hand, ten betas | all vertices | one pose |\n|---|---|---|---|---|\n");
    for (int i = 1; i < argc; ++i) {
      double best[4];
      std::ranges::fill(best, std::numeric_limits<double>::infinity());
      for (int round = 0; round < 5; ++round) {
        const auto t0 = std::clock();
        const auto model = holdfast::BodyModel::Load(argv[i]);
        const auto t1 = std::clock();
        const Eigen::VectorXd betas = Eigen::VectorXd::Ones(std::min(10, model->NumShape()));
        const holdfast::BodySurface hand(
            model, betas, model->HandVertexIds(model->LoneHand().value_or(holdfast::Side::kRight)));
        const auto t2 = std::clock();
        const holdfast::BodySurface whole(model, betas);
        const auto t3 = std::clock();
        holdfast::BodyState state;
        holdfast::Forward(whole, 0.1 * holdfast::JointPose::Ones(), Eigen::Vector3d::Zero(), state);
        const auto t4 = std::clock();
        const double took[] = {ms(t0, t1), ms(t1, t2), ms(t2, t3), ms(t3, t4)};
        for (int k = 0; k < 4; ++k) best[k] = std::min(best[k], took[k]);
      }
      fmt::print("| {} | {:.0f} | {:.0f} | {:.0f} | {:.1f} |\n", argv[i], best[0], best[1], best[2],
                 best[3]);
    }
  } catch (const holdfast::Error& error) {
    fmt::print(stderr, "body_model_load: {}\n", error.what());
    return 1;
  }
  return 0;
}
