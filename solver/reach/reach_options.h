// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "generator/scripted/reach_motion.h"
#include "generator/wandr/pose.h"
#include "geometry/body/body_model.h"
#include "geometry/body/skeleton.h"
#include "geometry/clip/clip.h"
#include "geometry/clip/clip_body.h"
#include "geometry/mesh/distance_grid.h"
#include "geometry/mesh/mesh.h"
#include "geometry/options.h"
#include "solver/grasp/grasp.h"
#include "solver/latent/vae_opt.h"

namespace holdfast {

/// The person who reaches, and the motion so far.
struct ReachPerson {
  std::shared_ptr<const BodyModel> body;
  Eigen::VectorXd betas;
  Clip like;  ///< body, betas and subject of generated clips
  BodyMeasures measures;
  wandr::BoneOffsets<double> bones;
  wandr::StateMatrix<double> states;  ///< at 30 Hz; the motion continues from the last

  int Frame() const { return static_cast<int>(states.cols()) - 1; }
  /// World, in the last of those frames.
  Eigen::Vector3d Pelvis() const;
  /// Maximum height of a wrist with both soles on the ground, meters.
  double HighestReach(Side side) const;
};

/// Stands at the origin, facing -y. Throws Error for a hand alone.
ReachPerson StandingPerson(std::shared_ptr<const BodyModel> body);

/// Continues from this frame of a clip (at the clip's rate, from 0); default: the last one. Throws
/// Error, named `source`, for a missing frame, positions that are not in meters, and a hand alone.
ReachPerson PersonInClip(Clip clip, const ClipBody& body, std::optional<int> frame = {},
                         const std::string& source = "the clip");

/// Measures of the person mirrored at x = 0 (wandr::MirroredBones): the network reaches with the
/// right wrist, so for the left one everything is mirrored.
BodyMeasures MirroredMeasures(const BodyMeasures& measures);

/// A solid obstacle, in the world.
struct ReachObstacle {
  std::string name;
  TriangleMesh mesh;
  /// Distances for the optimizer; of the mirrored mesh if the left wrist reaches.
  std::shared_ptr<const DistanceGrid> distance;

  /// Meters from the surface, negative inside; `point` is in the world, not mirrored.
  double Distance(const Eigen::Vector3d& point, Side side) const;
};

/// Throws Error for a mesh without an interior.
ReachObstacle MakeObstacle(std::string name, TriangleMesh mesh, Side side, int threads);

enum class ReachBy {
  kIntention,  ///< the network is conditioned on the goal and runs once
  kLatents,    ///< its latents are then optimized (LatentOptions)
  kVaeOpt,     ///< WANDR's baseline (VaeOptOptions)
};

/// "intention", "latent-opt" or "vae-opt".
std::string_view ReachMethodName(ReachBy by);

struct ReachOptions {
  ReachBy by = ReachBy::kIntention;
  Side side = Side::kRight;
  std::optional<int> samples;    ///< motions to choose from; default: 16, or 4 if optimized
  std::optional<double> time_s;  ///< for each goal; default: by WalkPace
  double sigma = 1.0;            ///< of the latents; 0: the mean motion
  bool refit = true;             ///< pin feet and place the wrist afterwards
  bool refit_all = false;        ///< for all motions, not only the best
  bool free_time = false;        ///< kLatents: arrive at any time up to 30 frames after it
  std::optional<Eigen::Vector3d> approach;  ///< kLatents: unit, along the forearm on arrival
  std::vector<ReachObstacle> obstacles;     ///< kLatents
  std::vector<int> stay_frames;             ///< kLatents: at each goal; empty: 16
  VaeOptOptions vae;                        ///< kVaeOpt: all but sigma and poll
  std::uint64_t seed = 1;
  int threads = 1;  ///< does not affect the result

  int NumSamples() const { return samples.value_or(by == ReachBy::kIntention ? 16 : 4); }
};

/// A reach as specified by the command line or Python.
struct ReachJob {
  std::optional<ReachBy> method;            ///< default: intention, or latent-opt with an object
  std::optional<VaeOptMethod> optimizer;    ///< vae-opt
  std::optional<int> iterations;            ///< vae-opt
  std::optional<double> prior_weight;       ///< vae-opt
  std::optional<Eigen::Vector3d> approach;  ///< any length
  std::optional<GraspStyle> grasp;          ///< of a taken object
  std::optional<double> object_yaw_deg;     ///< of the standing object
  double object_scale = 1.0;
  ReachOptions options;  ///< everything else; `by`, `approach` and `vae` are set by ReachOptionsOf
};

/// The options of `reach`.
OptionTable OptionsOf(ReachJob& job);

/// Returns the options of a job; `takes`: an object is taken. Throws Error for options that the
/// method ignores.
ReachOptions ReachOptionsOf(const ReachJob& job, bool takes);

}  // namespace holdfast
