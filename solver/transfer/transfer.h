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

/// One demonstration, others: a clip in which hands hold an object comes in; the same with another
/// object of the kind, or by another body, comes out, contacts kept, fitted and measured.

namespace holdfast {

/// What keeps its way through the world.
enum class TransferKeeps {
  kAuto,    ///< wrists where one hand of the same body holds in all frames, else the object
  kWrists,  ///< the object follows the first hand's wrist
  kObject,  ///< arms follow the object
};

struct TransferOptions {
  TransferKeeps keeps = TransferKeeps::kAuto;
  CarryGraspOptions grasp;    ///< seed and threads are those of `carry`
  CarryOptions carry;         ///< of the fit: grasp source and hands are set here
  double blend_s = 0.5;       ///< wrists come to their new paths and leave them in this time
  int object_vertices = 300;  ///< that objects are to be prepared with
};

/// The options of `transfer` to another object or body.
OptionTable OptionsOf(TransferOptions& options);

/// A hold of one hand, [begin, end), as it was carried over.
struct TransferredHold {
  Side side = Side::kRight;
  int begin = 0, end = 0;
  int frame = 0;  ///< whose contacts were carried: that with most of them
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

/// Carries every hold of a clip to another object, another body or both, and fits the result as
/// CarryObject does. `map` leads from `from_object` to `to_object` (SurfaceMap::Scaled by 1 for the
/// same one). Where the object keeps its way, it is turned and placed as the first one was
/// (SurfaceMap::InPlace). Hands are carried vertex by vertex, so that both bodies are of one model:
/// a clip of another is converted first (ConvertClip), with `onto` the clip as it was on the second
/// body (OntoOtherBody), since a converted body may stand on other soles; null to have it made from
/// `clip`. Throws Error for a clip without an object's trajectory, in which no hand holds or
/// touches it, bodies of two models, and what CarryObject throws.
TransferReport TransferClip(const Clip& clip, const ClipBody& from,
                            const PreparedObject& from_object, const ClipBody& to,
                            const PreparedObject& to_object, const SurfaceMap& map,
                            const TransferOptions& options = {},
                            const StagedProgress& progress = {}, const OntoBody* onto = nullptr);

/// The hands of two persons, with what transfers take of them; const, shared by threads.
struct TransferHands {
  TransferHands(const ClipBody& from, const ClipBody& to);

  std::vector<HandModel> from_hands, to_hands;                ///< right, left
  std::vector<std::unique_ptr<const CarryingHand>> carrying;  ///< null where there is no hand
};

/// Everything before the fit: the clip with arms, fingers of the holds and object where they
/// belong, and holding_hand.
/// `onto` is the clip on the second body
/// (OntoOtherBody), null to have it made here; `carriers` get those that were used.
Clip PrepareTransfer(const Clip& clip, const ClipBody& from, const PreparedObject& from_object,
                     const ClipBody& to, const PreparedObject& to_object, const SurfaceMap& map,
                     const TransferHands& hands, const TransferOptions& options,
                     TransferReport& report, const Clip* onto = nullptr,
                     std::vector<std::unique_ptr<const GraspCarrier>>* carriers = nullptr);

/// A map in numbers, units in the names.
nlohmann::json MapJson(const SurfaceMapReport& map);

/// What became of each hold, a list.
nlohmann::json TransferredHoldsJson(const std::vector<TransferredHold>& holds);

/// What kept its way, and how body and arms followed.
nlohmann::json FollowingJson(const TransferReport& report);

}  // namespace holdfast
