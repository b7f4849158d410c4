// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <vector>

#include "geometry/clip/clip.h"
#include "geometry/clip/clip_body.h"
#include "geometry/score/contact_score.h"
#include "solver/carry/carry.h"
#include "solver/carry/follow.h"
#include "solver/clearance/clearance.h"
#include "solver/fit/clip_refinement.h"
#include "solver/fit/finger_repair.h"

namespace holdfast {

enum class RefineHands {
  kFound,   ///< detected (FindHolds; FindFollows for a ball)
  kOfClip,  ///< from the clip's holding_hand
  kRight,
  kLeft,
  kBoth,
};

struct RefineOptions {
  RefineHands hands = RefineHands::kFound;
  FitOptions fit = RefinementDefaults();  ///< its threads are overridden by `threads`
  ContactProtocol protocol;               ///< of the measurements; its threads likewise
  int object_vertices = 300;              ///< number of vertices to prepare the object with
  bool keep_motion = false;               ///< only report collisions with the person's own body
  int threads = 1;                        ///< the result does not depend on it
};

/// Options of `refine`.
OptionTable OptionsOf(RefineOptions& options);

/// Quality measures of a clip, over the holding hands.
struct CarriedQuality {
  ContactScore contact;
  CarryJitter jitter;
  int hand_frames = 0;             ///< sum over hands of their held frames
  int hand_frames_in_contact = 0;  ///< of these
  FingertipCounts tips;            ///< in these
  int finger_jump_frames = 0;      ///< of both hands, in all frames
};

/// Distance of a refined object track from the data.
struct DataDistance {
  std::vector<double> mm, degrees;  ///< T
  double rms_mm = 0.0, rms_degrees = 0.0;
};

enum class RefineStatus {
  kRefined,
  kStopped,    ///< by `progress`
  kNotFinite,  ///< the solution is not finite
  kNoContact,  ///< no holding hand touches the object in any frame
};

/// Frames [begin, end).
struct FrameRange {
  int begin = 0, end = 0;
};

struct RefineReport {
  RefineStatus status = RefineStatus::kStopped;
  std::vector<FingerRepair> fingers;  ///< of each hand of the body
  bool ball = false;                  ///< refined by RefineBall
  RefineResult result;
  /// Frames kept from the clip, with blending around them: refined, their penetration would exceed
  /// the clip's maximum.
  std::vector<FrameRange> kept;
  CarriedQuality before, after;  ///< with the same hands in the same frames
  /// False if the fraction of held frames in contact dropped by more than 0.1. Always true for a
  /// ball that is followed.
  bool contact_kept = true;
  ClearanceReport clearance;  ///< empty for a lone hand
  DataDistance distance;

  /// Contact is kept, and neither arms nor object stay deeper than 10 mm in a body that may move.
  bool sound = true;
};

DataDistance DistanceToData(const Clip& data, const Clip& refined);

/// Refines a clip that has this object's trajectory: repairs fingers that jump (RepairFingers),
/// then object, arms and fingers (RefineClip; RefineBall if IsUnturnedBall); measures it before and
/// after. If frames stay deeper than kDeep_mm, or deeper than the clip's deepest, the clip is
/// solved again with ten times the penetration weights, and the better result is used. Maximum
/// penetration never increases: frames that are still too deep keep the clip's pose (`kept`). Then
/// arms and object are moved out of the person's own body (KeepOutOfBody).
/// `progress` receives "refine" and "metrics". Throws Error for a clip without an object
/// trajectory, one that no hand holds or penetrates, hands that the body lacks, and kOfClip without
/// holding_hand.
RefineReport RefineCarried(const Clip& clip, const ClipBody& body, const PreparedObject& object,
                           const RefineOptions& options = {}, const StagedProgress& progress = {});

/// Throws FitFailure if the refinement failed.
void RequireRefined(const RefineReport& report, const std::string& clip, const std::string& object);

}  // namespace holdfast
