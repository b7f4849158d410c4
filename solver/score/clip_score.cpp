// SPDX-License-Identifier: MIT
#include "solver/score/clip_score.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "generator/walk_statistics/balance.h"
#include "geometry/clip/resample.h"
#include "geometry/error.h"
#include "geometry/parallel.h"
#include "geometry/score/object_pose_error.h"
#include "geometry/score/object_rest.h"
#include "solver/fit/clip_state.h"
#include "solver/score/protocol_score.h"
#include "solver/trial/trial_scene.h"

namespace holdfast {
namespace {

// Notes in how many frames the volume is not exact, and why.
void NoteVolumes(const HandObjectScore& hand, const ScoreOptions& options,
                 std::vector<std::string>& notes) {
  for (const VolumeStatus status : {VolumeStatus::kOpenSurface, VolumeStatus::kSelfIntersecting,
                                    VolumeStatus::kNotResolved, VolumeStatus::kNotBuilt}) {
    const auto count = std::count_if(
        hand.frames.begin(), hand.frames.end(),
        [&](const HandObjectFrame& frame) { return frame.exact_volume.status == status; });
    if (count == 0) continue;
    notes.push_back(fmt::format(
        "{} hand: the exact intersection volume is undefined in {} of {} frames ({}); {}",
        SideName(hand.side), count, hand.frames.size(), Describe(status),
        options.exact == ExactMode::kOn || !options.hand_object.measure_voxels
            ? "these frames are left out"
            : fmt::format("these frames use voxels of {:g} mm",
                          options.hand_object.contact.voxel_mm)));
  }
}

// Measured hands, and in which frames each holds (empty: all).
struct Holders {
  std::vector<HandModel> hands;
  std::vector<std::vector<std::uint8_t>> holds;
};

Holders HoldersIn(const ClipScene& input, const SignedDistance& object, ClipScore& score) {
  const Clip& clip = input.clip;
  Holders holders;
  for (const Side side : {Side::kRight, Side::kLeft}) {
    const std::vector<std::uint8_t> flags = HoldFlags(clip.holding_hand, side);
    if (std::ranges::count(flags, std::uint8_t{1}) == 0 || !input.body->HasHand(side)) continue;
    holders.hands.emplace_back(input.body, input.betas, side);
    holders.holds.push_back(flags);
  }
  score.hands_by = "holding_hand";
  if (!holders.hands.empty()) return holders;
  holders.holds.emplace_back();
  if (const std::optional<Side> lone = input.body->LoneHand()) {
    score.hands_by = "only hand";
    holders.hands.emplace_back(input.body, input.betas, *lone);
    return holders;
  }
  score.hands_by = "nearest";
  HandModel right(input.body, input.betas, Side::kRight);
  HandModel left(input.body, input.betas, Side::kLeft);
  const int stride = std::max(1, clip.NumFrames() / 30);
  const bool right_is_nearer =
      MeanDistance(clip, right, object, stride) <= MeanDistance(clip, left, object, stride);
  holders.hands.push_back(std::move(right_is_nearer ? right : left));
  score.notes.push_back(fmt::format(
      "the clip does not specify the holding hand: the {} hand, which is nearer, is measured",
      SideName(holders.hands[0].HandSide())));
  return holders;
}

void MeasureRest(const ClipScene& input, const BodySurface& surface, const SignedDistance& object,
                 ClipScore& score) {
  score.in_air = FramesInMidAir(input.clip, surface, *input.object, object);
  const auto first = std::ranges::find(score.in_air, std::uint8_t{1});
  if (first == score.in_air.end()) return;
  score.notes.push_back(fmt::format(
      "the object is in mid-air in {} of {} frames, the first of them frame {}: it is still, and "
      "neither a hand nor the ground nor a table in the clip supports it",
      std::ranges::count(score.in_air, std::uint8_t{1}), score.frames,
      first - score.in_air.begin()));
}

// Returns false if stopped.
bool MeasureObject(const ClipScene& input, const BodySurface& surface, const ScoreOptions& options,
                   const StagedProgress& progress, ClipScore& score) {
  const Solid object(*input.object);
  score.object_source = input.object_source;
  score.object_vertices = object.mesh.NumVertices();
  score.object_faces = object.mesh.NumFaces();
  score.inside_by = object.IsClosed() ? "pseudonormal" : "winding number";
  if (!object.IsClosed()) {
    if (options.exact == ExactMode::kOn) {
      throw Error(input.object_source,
                  "is not watertight, so its exact intersection volume is undefined",
                  "Repair the mesh, or leave --exact at auto");
    }
    score.notes.push_back(
        "the object is not watertight: signed distance is not defined everywhere; inside is where "
        "the winding number exceeds 1/2");
  }
  std::optional<ExactIntersection> exact;
  if (options.hand_object.measure_exact) exact.emplace(object);
  const Holders holders = HoldersIn(input, object.distance, score);
  bool stopped = false;
  for (std::size_t h = 0; h < holders.hands.size(); ++h) {
    const HandModel& hand = holders.hands[h];
    score.hand_vertices = hand.NumVertices();
    score.hand_faces = hand.Surface().Faces().cols();
    const char* stage = hand.HandSide() == Side::kRight ? "right hand" : "left hand";
    score.hands.push_back(
        MeasureHandObject(input.clip, hand, object, exact ? &*exact : nullptr, options.hand_object,
                          holders.holds[h], [&](int done, int total) {
                            stopped = stopped || (progress && !progress(stage, done, total));
                            return !stopped;
                          }));
    if (stopped) return false;
    if (options.hand_object.measure_exact) NoteVolumes(score.hands.back(), options, score.notes);
  }
  MeasureRest(input, surface, object.distance, score);
  return true;
}

void MeasureBodyDepths(const ClipScene& input, const BodySurface& surface,
                       const ScoreOptions& options, const StagedProgress& progress,
                       ClipScore& score) {
  std::uint8_t holders = 0;
  for (const HandObjectScore& hand : score.hands) {
    holders |= hand.side == Side::kRight ? kHoldsRight : kHoldsLeft;
  }
  score.own_body = MeasureOwnBody(
      input.clip, surface, input.object ? &*input.object : nullptr, holders, options.threads,
      [&](int done, int total) { return !progress || progress("own body", done, total); });
  if (score.own_body) return;
  score.notes.push_back("the body model contains only a hand: depths in the body are not measured");
}

void MeasureBalance(const ClipScene& input, const BodySurface& surface, ClipScore& score) {
  const Eigen::Matrix3Xd& rest_joints = surface.RestJoints();
  score.off_balance_m = OffBalance(BodyFrames(input.clip, rest_joints), rest_joints,
                                   surface.RestVertices().row(1).minCoeff(), input.clip.frame_rate);
}

// Returns the frames of the reference to compare with the clip's.
Clip AlignReference(const ClipScene& input, const ClipScene& reference, const ScoreOptions& options,
                    ClipScore& score) {
  Clip clip = reference.clip;
  const double rate = input.clip.frame_rate;
  if (std::abs(clip.frame_rate - rate) > 1e-6 * rate) {
    if (!options.resample) {
      throw Error(input.source,
                  fmt::format("runs at {:g} Hz, its reference {} at {:g} Hz", rate,
                              reference.source, clip.frame_rate),
                  "Give --resample to resample the reference, or clips with the same frame rate");
    }
    score.notes.push_back(fmt::format(
        "the reference was resampled from {:g} to {:g} Hz (rotations by the shortest arc, "
        "translations linear)",
        clip.frame_rate, rate));
    clip = Resample(clip, rate);
  }
  if (clip.NumFrames() != input.clip.NumFrames()) {
    const int common_frames = std::min(clip.NumFrames(), input.clip.NumFrames());
    if (!options.overlap) {
      throw Error(
          input.source,
          fmt::format("has {} frames, its reference {} has {}", input.clip.NumFrames(),
                      reference.source, clip.NumFrames()),
          fmt::format(
              "Give --overlap to compare the first {} frames of both, or clips of the same length",
              common_frames));
    }
    score.notes.push_back(
        fmt::format("compared with the reference over the first {} frames only", common_frames));
    clip = Slice(clip, 0, common_frames);
  }
  return clip;
}

// Poses of two different objects cannot be compared.
void RequireSameObject(const ClipScene& input, const ClipScene& reference, double diameter_m) {
  if (!reference.object) return;
  const auto low = [](const TriangleMesh& mesh) { return mesh.vertices.rowwise().minCoeff(); };
  const auto high = [](const TriangleMesh& mesh) { return mesh.vertices.rowwise().maxCoeff(); };
  const double apart = std::max((low(*input.object) - low(*reference.object)).norm(),
                                (high(*input.object) - high(*reference.object)).norm());
  if (apart < 0.05 * diameter_m) return;
  throw Error(
      input.object_source,
      fmt::format("is not the object of the reference ({}): their boxes differ by {:.1f} mm",
                  reference.object_source, 1e3 * apart),
      "Give clips of the same object in the same object coordinates");
}

void CompareObjects(const ClipScene& input, const ClipScene& reference, const Clip& aligned,
                    const ScoreOptions& options, ReferenceScore& result, ClipScore& score) {
  if (!input.object || !input.clip.object || !aligned.object) {
    score.notes.push_back(
        fmt::format("{} has no object: object poses are not compared",
                    !input.object || !input.clip.object ? "the clip" : "the reference"));
    return;
  }
  ObjectSymmetry symmetry;
  symmetry.center = MeasureMoments(*input.object).center;
  if (options.symmetry != SymmetryMode::kOff) symmetry = DetectSymmetry(*input.object);
  if (options.symmetry == SymmetryMode::kOn && !symmetry.Any()) {
    score.notes.push_back(
        "treated as symmetric as requested, but no rotation maps the object onto itself: rotation "
        "errors are the same as without symmetry; use ADD-S instead");
  }
  const ObjectPoseComparer comparer(*input.object, symmetry);
  RequireSameObject(input, reference, comparer.Diameter_m());
  result.symmetry = symmetry;
  result.diameter_mm = 1e3 * comparer.Diameter_m();
  const std::vector<Eigen::Isometry3d> poses = ObjectPoses(input.clip);
  const std::vector<Eigen::Isometry3d> wanted = ObjectPoses(aligned);
  result.object.resize(static_cast<std::size_t>(result.frames));
  ParallelFor(result.frames, options.threads,
              [&](int t) { result.object[t] = comparer.Compare(poses[t], wanted[t]); });
}

ReferenceScore CompareWith(const ClipScene& input, const ClipScene& reference,
                           const ScoreOptions& options, ClipScore& score) {
  const Clip aligned = AlignReference(input, reference, options, score);
  ReferenceScore result;
  result.source = reference.source;
  result.frames = std::min(aligned.NumFrames(), input.clip.NumFrames());
  const auto points = BodyTrajectory(input.clip, input.body, input.betas);
  const auto wanted = BodyTrajectory(aligned, reference.body, reference.betas);
  for (int t = 0; t < result.frames; ++t) {
    result.joints.push_back(CompareJoints(points[t], wanted[t]));
  }
  CompareObjects(input, reference, aligned, options, result, score);
  return result;
}

}  // namespace

OptionTable OptionsOf(ScoreOptions& options) {
  ContactProtocol& contact = options.hand_object.contact;
  OptionTable table;
  table.Number("contact_threshold", "mm", contact.contact_threshold_mm, kPositive,
               "Hand vertices closer than this to the object are in contact, mm");
  table.Number("depth_threshold", "mm", options.deep_mm, kNonNegative,
               "Frames with penetration deeper than this are counted, mm");
  table.Number("voxel", "mm", contact.voxel_mm, kNonNegative,
               "Edge of the voxels for intersection volume, mm; 0: none");
  table.Choice(
      "exact", options.exact,
      {{"off", ExactMode::kOff}, {"auto", ExactMode::kAuto}, {"on", ExactMode::kOn}},
      "Compute the exact intersection volume by cutting the meshes: off (use voxels), auto "
      "(use voxels in frames where it is undefined) or on (skip such frames)");
  table.Choice(
      "symmetric", options.symmetry,
      {{"off", SymmetryMode::kOff}, {"auto", SymmetryMode::kAuto}, {"on", SymmetryMode::kOn}},
      "Whether rotation errors allow for symmetry of the object: auto (if it is detected), off or "
      "on. ADD and ADD-S are always reported");
  table.Choice("protocol", options.protocol,
               {{"none", ScoreProtocol::kNone},
                {"grab", ScoreProtocol::kGrab},
                {"dexgraspnet", ScoreProtocol::kDexGraspNet},
                {"graspqp", ScoreProtocol::kGraspQp},
                {"contactopt", ScoreProtocol::kContactOpt},
                {"v2d", ScoreProtocol::kV2d}},
               "Also score by a published protocol; its simulated trials need MuJoCo");
  table.Flag("overlap", options.overlap,
             "Compare a clip and its reference up to the length of the shorter one");
  table.Flag("resample", options.resample, "Resample the reference to the clip's frame rate");
  return table;
}

void SettleScoreOptions(ScoreOptions& options) {
  HandObjectProtocol& protocol = options.hand_object;
  protocol.contact.threads = options.threads;
  protocol.measure_exact = options.exact != ExactMode::kOff;
  protocol.measure_voxels = protocol.contact.voxel_mm > 0.0;
  if (protocol.measure_voxels || protocol.measure_exact) return;
  throw Error("--voxel 0", "excludes --exact off: no volume would be measured",
              "Give a voxel size, or leave --exact at auto");
}

ClipScore ScoreClip(const ClipScene& input, const ClipScene* reference, const ScoreOptions& options,
                    const StagedProgress& progress) {
  ClipScore score;
  score.source = input.source;
  score.frames = input.clip.NumFrames();
  score.frame_rate = input.clip.frame_rate;
  score.body = input.body->Name();
  score.foreign_body = input.foreign_body;
  if (score.foreign_body) {
    score.notes.push_back(
        fmt::format("made with a different body model ({}) than the one loaded ({}): metrics that "
                    "depend on the hand's surface are not those of the clip's own hand (give its "
                    "model with --body MODEL.npz)",
                    input.made_with, input.body->Name()));
  }
  const BodySurface surface = input.Surface();
  const std::vector<JointPositions> joints = JointTrajectory(input.clip, surface.RestJoints());
  score.motion = MeasureMotion(joints, input.clip.frame_rate);
  if (!input.body->LoneHand()) {
    score.standing = MeasureStanding(input.clip, joints, surface.RestJoints(),
                                     input.object ? &*input.object : nullptr);
  }
  // Before the long part, so that incomparable clips are rejected at once.
  if (reference != nullptr) score.reference = CompareWith(input, *reference, options, score);
  if (input.clip.object && input.object) {
    if (!MeasureObject(input, surface, options, progress, score)) return score;
    score.vessel = MeasureVesselTilt(input.clip, *input.object);
    const bool tries = options.protocol == ScoreProtocol::kDexGraspNet ||
                       options.protocol == ScoreProtocol::kGraspQp;
    if (tries && !HasPhysics()) {
      score.notes.push_back("the protocol's trial was not run: this build has no MuJoCo");
    }
    bool going = true;
    score.by_protocol =
        ScoreByProtocol(input, score, options.protocol, options.threads, [&](int done, int total) {
          going = going && (!progress || progress("protocol", done, total));
          return going;
        });
    if (!going) return score;
  } else {
    score.notes.push_back(input.clip.object
                              ? fmt::format("the object's mesh was not found ({}): only motion is "
                                            "measured (give the mesh with --object MESH)",
                                            input.object_missing)
                              : "the clip has no object: only motion is measured");
  }
  MeasureBodyDepths(input, surface, options, progress, score);
  if (!input.body->LoneHand()) MeasureBalance(input, surface, score);
  return score;
}

}  // namespace holdfast
