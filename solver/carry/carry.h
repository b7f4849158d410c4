// SPDX-License-Identifier: MIT
#pragma once

/// End-to-end pipelines for held objects. Input: a clip with its body (or a body to be posed
/// standing) and an object. Output: the clip with the object held in every frame, and a report.

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

namespace holdfast {

/// Source of the grasp: the clip if it has one of this object, else new; always new; always the
/// clip.
enum class GraspSource { kClipsOrNew, kNew, kClips };
enum class FitRecipe {
  kHoldfast,  ///< all terms
  kPaper,     ///< the paper's three terms
  kImosCode,  ///< as in the paper's code
};

struct CarryOptions {
  GraspHands hands = GraspHands::kAuto;
  GraspSource grasp = GraspSource::kClipsOrNew;
  /// Mesh of the clip's object, if known: decides whether it is the same object.
  std::optional<TriangleMesh> clip_object;
  /// Model that the clip was made with (BodyChange::from) if it is of another kind than the body,
  /// so that the clip's grasp belongs to a different hand. Empty: the clip is of this body.
  std::string other_body;
  double object_scale = 1.0;        ///< scale with which the object was loaded
  std::optional<GivenGrasp> given;  ///< in place of a new grasp, for its hand
  std::optional<GraspStyle> style;  ///< for a new grasp
  std::optional<GraspUse> use;      ///< for a new grasp; none: inferred from the shape
  /// Where hands grasp; none: anywhere. Region and avoid also apply to the hands that receive the
  /// object. The span is set here.
  std::optional<GraspPlace::Wanted> place;
  /// The person in the clip drinks: the object is put into the drinking hand (ServeDrink); hands,
  /// style, place etc. are ignored.
  bool drink = false;
  bool hand_over = false;          ///< the object changes hands
  HandoverSearchOptions handover;  ///< known facts about it
  FitRecipe recipe = FitRecipe::kHoldfast;
  /// Only measure where object, hand or forearm penetrate the person's own body, without changing
  /// the motion. Recipes other than kHoldfast never change it for this, and do not measure it.
  bool keep_motion = false;
  /// Keep released hands clear of the object on their way (ClearPassages), as after handovers.
  bool clear_passages = false;
  FitOptions fit;            ///< its threads are overridden by `threads`
  ContactProtocol protocol;  ///< of the measurements; its threads likewise
  std::uint64_t seed = 1;
  int threads = 1;  ///< the result does not depend on it
};

enum class CarryStatus {
  kCarried,
  kStopped,    ///< by `progress`
  kNoGrasp,    ///< no grasp exists: see grasp.status
  kNoContact,  ///< no hand touches the object in any frame
};

struct CarryReport {
  CarryStatus status = CarryStatus::kStopped;
  Clip clip;                 ///< with the object, fitted fingers and arms, and holding_hand
  std::uint8_t held_by = 0;  ///< bits of all hands that hold in some frame
  HoldLabels holding;        ///< before the fit
  FirstGrasp grasp;
  std::optional<DrinkReport> drink;    ///< with CarryOptions::drink
  std::optional<DrinkMeasures> drunk;  ///< measured in the result
  std::vector<Handover> handovers;
  FitResult fit;              ///< its `clip` is moved to `clip` above
  ClearanceReport clearance;  ///< avoidance of the body by the arms; recipe kHoldfast
  ContactScore contact;
  /// The result passes its own checks: grasps are clean and holding hands touch the object in most
  /// frames. If false, `warnings` (or those of `grasp`) give the reasons.
  bool sound = true;
  std::vector<std::string> warnings;
};

/// Whether CarryObject needs a new grasp: the clip has no object, a new grasp or a place is
/// requested, or the clip's grasp is of another object or another body's hand.
bool NeedsGrasp(const Clip& clip, const LoadedObject& object, const CarryOptions& options);

/// Why the clip's grasp is not kept, as a message that calls the object `name`. Empty if it is
/// kept, if there is none, and if a new one is requested.
std::string WhyNewGrasp(const Clip& clip, const LoadedObject& object, const std::string& name,
                        const CarryOptions& options);

/// Fits the object to the clip. An object trajectory in the clip is kept as data; without one, a
/// hand grasps the object in the first frame and holds it. Where that grasp is not clean, or object
/// or arms go through the person's body, up to three more searches with other seeds follow; the
/// first sound result is returned. `body` is the clip's (BodyOfClip). Throws Error for hands that
/// the body lacks, an object that no hand holds, and what GraspPlace, FindHandovers and FitClip
/// throw. The stages, in order, are in Carrier::Run (carry.cpp).
///
///   LoadedClip motion = LoadClip("walk.npz");
///   CarryReport carried = CarryObject(motion.clip, motion.body, PrepareObject(LoadObject("mug")));
///   WriteClip(carried.clip, "held.npz");
CarryReport CarryObject(const Clip& clip, const ClipBody& body, const PreparedObject& object,
                        const CarryOptions& options = {}, const StagedProgress& progress = {});

}  // namespace holdfast
