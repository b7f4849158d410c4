// SPDX-License-Identifier: MIT
#pragma once

/// Objects held, as whole jobs. A clip and its body, or a body that is to stand, and an object go
/// in; the clip with the object held in every frame, and a report, come out.

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "geometry/clip/clip.h"
#include "geometry/clip/clip_body.h"
#include "geometry/parallel.h"
#include "geometry/score/contact_score.h"
#include "geometry/score/hand_object_score.h"
#include "solver/carry/drink.h"
#include "solver/carry/first_grasp.h"
#include "solver/clearance/clearance.h"
#include "solver/fit/fit.h"
#include "solver/fit/prepared_object.h"
#include "solver/handover/grasps_by_transfer.h"
#include "solver/handover/handover_search.h"
#include "solver/handover/holds.h"

/// The whole job: who holds the object, how the hand takes it, and every frame fitted.
///
///   LoadedClip motion = LoadClip("walk.npz");
///   CarryReport carried = CarryObject(motion.clip, motion.body, PrepareObject(LoadObject("mug")));
///   WriteClip(carried.clip, "held.npz");
namespace holdfast {

enum class CarryHands { kAuto, kRight, kLeft, kBoth };
/// Whose grasp: of the clip where it has one of this object, always a new one, never.
enum class GraspSource { kClipsOrNew, kNew, kClips };
enum class FitRecipe {
  kHoldfast,  ///< all terms
  kPaper,     ///< the paper's three
  kImosCode,  ///< what its authors' code does
};

struct CarryOptions {
  CarryHands hands = CarryHands::kAuto;
  GraspSource grasp = GraspSource::kClipsOrNew;
  /// The surface that the clip's object has, where it is known: tells whether it is this one.
  std::optional<TriangleMesh> clip_object;
  /// The model that the clip was made with (BodyChange::from), where it is of another kind than the
  /// body: the clip's grasp is of another hand. Empty: the body's own clip.
  std::string other_body;
  double object_scale = 1.0;        ///< that the object was loaded with
  std::optional<GraspStyle> style;  ///< of a grasp that has to be made
  std::optional<GraspUse> use;      ///< and what the object is taken for; none: by its shape
  /// Where hands take hold, with region and avoid of those that the object is handed to as well;
  /// none: wherever it suits. Its span is set here.
  std::optional<GraspPlace::Wanted> place;
  /// The clip's person drinks: the object is put into the hand that does (ServeDrink); hands,
  /// style, place and so on say nothing.
  bool drink = false;
  bool hand_over = false;          ///< the object changes hands
  HandoverSearchOptions handover;  ///< what is known of that
  FitRecipe recipe = FitRecipe::kHoldfast;
  /// Where object, hand or forearm would go through the person's own body: measure it only, and
  /// leave the motion as it is. Recipes other than kHoldfast always do, and do not measure.
  bool keep_motion = false;
  /// Hands that let go in the clip keep off the object on their way (ClearPassages), as after
  /// hand-overs.
  bool clear_passages = false;
  FitOptions fit;            ///< threads are those below
  ContactProtocol protocol;  ///< of the measurements; threads are those below
  std::uint64_t seed = 1;
  int threads = 1;  ///< the result does not depend on them
};

enum class CarryStatus {
  kCarried,
  kStopped,    ///< by `progress`
  kNoGrasp,    ///< there is nothing to take hold of: grasp.status
  kNoContact,  ///< no hand touches the object in any frame
};

struct CarryReport {
  CarryStatus status = CarryStatus::kStopped;
  Clip clip;                 ///< with the object, fitted fingers and arms, and holding_hand
  std::uint8_t held_by = 0;  ///< bits of all hands that hold at some time
  HoldLabels holding;        ///< before the fit
  FirstGrasp grasp;
  std::optional<DrinkReport> drink;    ///< with CarryOptions::drink
  std::optional<DrinkMeasures> drunk;  ///< the same in the result
  std::vector<Handover> handovers;
  FitResult fit;              ///< its `clip` is moved to the one above
  ClearanceReport clearance;  ///< how the arms avoided the body; recipe kHoldfast
  ContactScore contact;
  double fit_s = 0.0;
  /// The result passes its own checks: grasps are clean, the hands that hold touch the object in
  /// most frames. Where it does not, `warnings` (or the grasp's) say why.
  bool sound = true;
  std::vector<std::string> warnings;
};

/// Whether the object that a clip has is this one: of the same surface, where the clip's own is
/// known (as given or times `scale`), else of the same name.
bool IsObjectOf(const Clip& clip, const std::optional<TriangleMesh>& clip_object,
                const LoadedObject& object, double scale = 1.0);

/// Whether CarryObject has to make a grasp: the clip has no object, one is asked for (a new one, or
/// a place), or the clip's is of another object or another body's hand.
bool NeedsGrasp(const Clip& clip, const LoadedObject& object, const CarryOptions& options);

/// Why the grasp that a clip has is not kept, for people, `object` being called `name`. Empty where
/// it is, where there is none, and where a new one is asked for.
std::string WhyNewGrasp(const Clip& clip, const LoadedObject& object, const std::string& name,
                        const CarryOptions& options);

/// Carries the object through the clip. A clip that has the object's trajectory keeps it as data;
/// without, a hand takes the object in the first frame and holds it. `body` is the clip's
/// (BodyOfClip). Throws Error for hands that the body lacks, an object that no hand holds,
/// and what GraspPlace, FindHandovers and FitClip throw.
CarryReport CarryObject(const Clip& clip, const ClipBody& body, const PreparedObject& object,
                        const CarryOptions& options = {}, const StagedProgress& progress = {});

}  // namespace holdfast
