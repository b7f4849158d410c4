// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <vector>

#include "geometry/clip/clip.h"
#include "geometry/clip/clip_body.h"
#include "geometry/score/contact_score.h"
#include "solver/carry/carry.h"
#include "solver/carry/refine_ball.h"
#include "solver/fit/clip_refinement.h"
#include "solver/fit/finger_repair.h"

namespace holdfast {

enum class RefineHands {
  kFound,   ///< who holds is found in the clip (FindHolds; FindFollows of a ball)
  kOfClip,  ///< as its holding_hand says
  kRight,
  kLeft,
  kBoth,
};

struct RefineOptions {
  RefineHands hands = RefineHands::kFound;
  FitOptions fit = RefinementDefaults();  ///< threads are those below
  ContactProtocol protocol;               ///< of the measurements; threads are those below
  int object_vertices = 300;              ///< that the object is to be prepared with
  int threads = 1;                        ///< the result does not depend on them
};

/// The options of `refine`.
OptionTable OptionsOf(RefineOptions& options);

/// A clip in numbers, over the hands that hold.
struct CarriedQuality {
  ContactScore contact;
  CarryJitter jitter;
  int hand_frames = 0;             ///< in which a hand holds, both hands counted
  int hand_frames_in_contact = 0;  ///< of them
  FingertipCounts tips;            ///< in them
  int finger_jump_frames = 0;      ///< of both hands, in all frames
};

/// How far a refined object is from the data.
struct DataDistance {
  std::vector<double> mm, degrees;  ///< T
  double rms_mm = 0.0, rms_degrees = 0.0;
};

enum class RefineStatus {
  kRefined,
  kStopped,    ///< by `progress`
  kNotFinite,  ///< the solve came to no numbers
  kNoContact,  ///< no hand that holds touches the object in any frame
};

/// Frames [begin, end).
struct FrameRange {
  int begin = 0, end = 0;
};

struct RefineReport {
  RefineStatus status = RefineStatus::kStopped;
  std::vector<FingerRepair> fingers;  ///< of each hand that the body has
  bool ball = false;                  ///< as RefineBall does
  RefineResult result;
  /// Frames that stay as the clip has them, and others blend into: refined, they were deeper than
  /// any of the clip's.
  std::vector<FrameRange> kept;
  CarriedQuality before, after;  ///< by the same hands in the same frames
  /// Not in contact in fewer of the frames held than before, by more than a tenth of them. Of a
  /// ball that is followed nothing is asked.
  bool contact_kept = true;
  DataDistance distance;
};

DataDistance DistanceToData(const Clip& data, const Clip& refined);

/// Cleans a clip that has this object's trajectory: fingers that jump (RepairFingers), then object,
/// arms and fingers (RefineClip; RefineBall where IsUnturnedBall); and measures it before and
/// after. The deepest frame is never deeper than before: where it would be, the clip is solved
/// again with ten times the weights of penetration, and frames that are too deep still stay as the
/// clip has them (`kept`). `progress` sees "refine" and "metrics". Throws Error for a clip without
/// an object trajectory, one that no hand holds or gets into, hands that the body lacks, and
/// kOfClip without holding_hand.
RefineReport RefineCarried(const Clip& clip, const ClipBody& body, const PreparedObject& object,
                           const RefineOptions& options = {}, const StagedProgress& progress = {});

/// FitFailure where nothing came of it.
void RequireRefined(const RefineReport& report, const std::string& clip, const std::string& object);

}  // namespace holdfast
