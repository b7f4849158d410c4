// SPDX-License-Identifier: MIT
#include "generator/wandr/run_rollouts.h"

#include <algorithm>

#include <fmt/format.h>

#include "generator/nn/random_stream.h"
#include "geometry/error.h"
#include "geometry/parallel.h"

namespace holdfast::wandr {
namespace {

// Enough for products to be bound by arithmetic; activations still fit a core's cache.
constexpr int kBatch = 48;

void Check(const RolloutRequest& request, const Network<float>& network) {
  const std::size_t count = request.starts.size();
  if (count == 0 || request.num_steps < 1) {
    throw Error("rollout", fmt::format("{} motions of {} steps", count, request.num_steps),
                "Ask for at least one motion of one step");
  }
  if (request.plans.size() != count) {
    throw Error("rollout", fmt::format("{} goals for {} starts", request.plans.size(), count),
                "Give one plan per start (an empty one for motion without a goal)");
  }
  if (request.latents &&
      (request.latents->cols() != static_cast<Eigen::Index>(count) ||
       request.latents->rows() != Eigen::Index{network.LatentSize()} * request.num_steps)) {
    throw Error(
        "rollout",
        fmt::format("latents are {} x {}, {} x {} are needed", request.latents->rows(),
                    request.latents->cols(), network.LatentSize() * request.num_steps, count),
        "Give one column per motion, all steps below each other");
  }
  for (std::size_t i = 0; i < count; ++i) {
    if (!StateOf(request.starts[i].pose).allFinite() ||
        !request.starts[i].previous_delta.allFinite()) {
      throw Error(fmt::format("rollout[{}]", i), "the start pose is not finite",
                  "Check the clip it comes from");
    }
    for (const Waypoint& waypoint : request.plans[i]) {
      if (!waypoint.position.allFinite()) {
        throw Error(fmt::format("rollout[{}]", i), "the goal is not finite",
                    "Give three numbers, metres");
      }
    }
  }
}

}  // namespace

Eigen::VectorXf DrawLatents(std::uint64_t seed, std::uint64_t stream, int latent_size,
                            int num_steps, double sigma) {
  Eigen::VectorXf latents(Eigen::Index{latent_size} * num_steps);
  nn::RandomStream random(seed, stream);
  double pair[2] = {};
  for (Eigen::Index k = 0; k < latents.size(); ++k) {
    if (k % 2 == 0) random.NormalPair(pair[0], pair[1]);
    latents[k] = static_cast<float>(sigma * pair[k % 2]);
  }
  return latents;
}

void RunRollouts(const Network<float>& network, const BoneOffsets<float>& bones,
                 const RolloutRequest& request, int threads, const RolloutOptions& options,
                 const std::function<void(int, const RolloutTrack&)>& take) {
  Check(request, network);
  const int count = static_cast<int>(request.starts.size()), steps = request.num_steps;
  const int batch = std::clamp((count + threads - 1) / std::max(threads, 1), 1, kBatch);
  const int num_batches = (count + batch - 1) / batch;
  const int latent_size = network.LatentSize();
  // Each worker takes every so many-th batch, so that its memory is allocated once.
  const int workers = std::clamp(threads, 1, num_batches);
  ParallelFor(workers, workers, [&](int worker) {
    Rollout<float> rollout(network, bones, batch, steps, options);
    RolloutTrack track{StateMatrix<float>(kStateSize, steps + 1),
                       Eigen::MatrixXf(kJointNumbers, steps + 1)};
    Eigen::MatrixXf latents(Eigen::Index{latent_size} * steps, batch);
    Eigen::MatrixXf step_latents(latent_size, batch);
    BodyKinematics<float> kinematics;
    for (int b = worker; b < num_batches; b += workers) {
      const int first = b * batch, size = std::min(batch, count - first);
      for (int i = 0; i < size; ++i) {
        if (request.latents) {
          latents.col(i) = request.latents->col(first + i);
        } else {
          latents.col(i) = DrawLatents(request.seed, request.first_stream + first + i, latent_size,
                                       steps, request.sigma);
        }
      }
      rollout.Begin(request.starts.subspan(first, size), request.plans.subspan(first, size));
      for (int t = 0; t < steps; ++t) {
        step_latents.leftCols(size) =
            latents.block(Eigen::Index{latent_size} * t, 0, latent_size, size);
        rollout.Step(step_latents.leftCols(size));
      }
      for (int i = 0; i < size; ++i) {
        for (int t = 0; t <= steps; ++t) {
          const Pose<float>& pose = rollout.Poses(t)[i];
          WriteState<float>(pose, track.states.col(t));
          ForwardKinematics(bones, pose, kinematics);
          Eigen::Map<BodyJoints<float>>(track.joints.col(t).data()) = kinematics.joints;
        }
        take(first + i, track);
      }
    }
  });
}

std::vector<RolloutTrack> RunRollouts(const Network<float>& network,
                                      const BoneOffsets<float>& bones,
                                      const RolloutRequest& request, int threads,
                                      const RolloutOptions& options) {
  std::vector<RolloutTrack> tracks(request.starts.size());
  RunRollouts(network, bones, request, threads, options,
              [&](int i, const RolloutTrack& track) { tracks[i] = track; });
  return tracks;
}

}  // namespace holdfast::wandr
