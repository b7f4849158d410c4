// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "geometry/clip/clip.h"
#include "geometry/clip/clip_body.h"
#include "geometry/options.h"
#include "geometry/parallel.h"
#include "solver/carry/carry.h"
#include "solver/fit/prepared_object.h"
#include "solver/transfer/carried_grasp.h"
#include "solver/transfer/other_body.h"
#include "solver/transfer/surface_map.h"

/// Transfers a demonstration: from a clip in which hands hold an object to the same motion with a
/// similar object or by another body, with contacts preserved, fitted and measured.

namespace holdfast {

/// What keeps its world trajectory.
enum class TransferKeeps {
  kAuto,    ///< wrists if one hand of the same body holds in all frames, else the object
  kWrists,  ///< the object follows the first hand's wrist
  kObject,  ///< arms follow the object
};

struct TransferOptions {
  TransferKeeps keeps = TransferKeeps::kAuto;
  bool search = true;         ///< search a new grasp nearby if the transferred one is not clean
  CarryOptions carry;         ///< of the fit; grasp source and hands are overridden
  int object_vertices = 300;  ///< for preparing objects
};

/// The options of `transfer` to another object or body.
OptionTable OptionsOf(TransferOptions& options);

/// A transferred hold of one hand, [begin, end).
struct TransferredHold {
  Side side = Side::kRight;
  int begin = 0, end = 0;
  int frame = 0;  ///< frame of the transferred contacts: the one with most
  CarriedGrasp grasp;
};

struct TransferReport {
  CarryReport carried;  ///< its `clip` is the result
  std::vector<TransferredHold> holds;
  bool kept_wrists = false;
  OtherBodyReport body;
  ArmReport arms;
  std::vector<std::string> warnings;  ///< of the transfer; the fit's are in `carried`
};

/// Transfers every hold of a clip to another object, another body or both, and fits the result as
/// CarryObject does. `map` leads from `from_object` to `to_object` (SurfaceMap::Scaled by 1 for the
/// same object). If the object keeps its trajectory, it is rotated and placed like the first one
/// (SurfaceMap::InPlace). Hands are transferred by vertex, so both bodies must have the same model:
/// a clip of another model is converted first (ConvertClip), with `onto` the original clip on the
/// second body (OntoOtherBody), because a converted body may have other soles; if null, it is
/// computed from `clip`. Throws Error for a clip without an object trajectory or in which no hand
/// holds or touches the object, for bodies of two models, and as CarryObject does.
TransferReport TransferClip(const Clip& clip, const ClipBody& from,
                            const PreparedObject& from_object, const ClipBody& to,
                            const PreparedObject& to_object, const SurfaceMap& map,
                            const TransferOptions& options = {},
                            const StagedProgress& progress = {}, const OntoBody* onto = nullptr);

/// The hands of two persons, with derived data; const and thread-safe.
struct TransferHands {
  TransferHands(const ClipBody& from, const ClipBody& to);

  std::vector<HandModel> from_hands, to_hands;                ///< right, left
  std::vector<std::unique_ptr<const CarryingHand>> carrying;  ///< null if there is no hand
};

/// Performs everything before the fit: returns the clip with arms, fingers of the holds, object and
/// holding_hand. `onto` is the clip on the second body (OntoOtherBody), computed here if null;
/// `carriers` receives those that were used.
Clip PrepareTransfer(const Clip& clip, const ClipBody& from, const PreparedObject& from_object,
                     const ClipBody& to, const PreparedObject& to_object, const SurfaceMap& map,
                     const TransferHands& hands, const TransferOptions& options,
                     TransferReport& report, const Clip* onto = nullptr,
                     std::vector<std::unique_ptr<const GraspCarrier>>* carriers = nullptr);

/// The report of a map; units in the names.
nlohmann::json MapJson(const SurfaceMapReport& map);

/// The outcome of each hold, as a list.
nlohmann::json TransferredHoldsJson(const std::vector<TransferredHold>& holds);

/// What kept its trajectory, and how body and arms followed.
nlohmann::json FollowingJson(const TransferReport& report);

}  // namespace holdfast
