// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "geometry/mesh/distance_grid.h"
#include "geometry/mesh/mesh.h"
#include "geometry/options.h"
#include "solver/grasp/grasp_handle.h"
#include "solver/grasp/grasp_placement.h"

namespace holdfast {

/// Use of an object, as far as it affects how people grasp it.
enum class GraspUse {
  kAny,     ///< any firm grasp
  kHandle,  ///< by the bar of a loop: mug, jug, scissors
  kTool,    ///< by its bar, thumb side towards the head: hammer, knife, pan, drill
  kVessel,  ///< upright, from the side, opening or neck free: bottle, can, glass
  kBox,     ///< across the narrow side
  kDish,    ///< level, by the rim: bowl, plate
  kCamera,  ///< by the side of its body, fingers in front and thumb behind, lens and back free
  kPhone,   ///< flat: its back in the palm, fingers and thumb at the long edges, screen free
};
std::string_view UseName(GraspUse use);
/// Adds --use: a UseName, or "auto" (no value).
void AddUseOption(OptionTable& table, std::optional<GraspUse>& use);

/// Region of space around an axis, object frame, meters.
struct UseZone {
  Eigen::Vector3d base, axis;        ///< the axis is unit
  double low, high;                  ///< along the axis, from `base`
  double inner = 0.0, radius = 1e3;  ///< distances from the axis
  /// 1 inside, 0 farther than `soft_m` outside, linear in between.
  double Share(const Eigen::Vector3d& point, double soft_m) const;
};

/// How people grasp an object, inferred from its shape. Directions are unit, or zero if
/// unconstrained; object frame. Const and shared by threads.
struct ObjectUse {
  GraspUse kind = GraspUse::kAny;
  std::optional<UseZone> hold;             ///< where contacts belong
  std::optional<Eigen::Vector3d> held_at;  ///< center of that region; none: the centroid
  bool held_anywhere = false;              ///< a rim: all places are equally far from the center
  std::vector<UseZone> keep_free;          ///< no skin here: opening, lens, screen
  double keep_free_weight = 6.0;           ///< score penalty for all skin there
  std::vector<Eigen::Vector3d> press;      ///< forces along one of these
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  double up_weight = 0.0;     ///< importance of this up direction; 0: default
  bool up_over_clip = false;  ///< up on average over the clip, instead of in the first frame
  Eigen::Vector3d thumb = Eigen::Vector3d::Zero();  ///< direction of the hand's thumb side
  Eigen::Vector3d ahead = Eigen::Vector3d::Zero();  ///< direction of the hand, wrist to knuckles
  Eigen::Vector3d palm = Eigen::Vector3d::Zero();   ///< direction that the palm faces
  double palm_worth = 0.2;                          ///< score of a palm in contact, in power style

  /// In [0, 1]: whether people touch the surface at this point.
  double HoldWeight(const Eigen::Vector3d& point) const;
  /// In [0, 1]: suitability of two antipodal places that a hand presses together.
  double OppositionWeight(const Eigen::Vector3d& center, const Eigen::Vector3d& axis) const;
  /// Score of the hand's orientation: 0 for the best, else negative. `across` is the unit direction
  /// to the thumb's side, `forward` from the wrist to the knuckles, `facing` out of the palm,
  /// object frame.
  double DirectionScore(const Eigen::Vector3d& across, const Eigen::Vector3d& forward,
                        const Eigen::Vector3d& facing) const;
  /// Fraction of points (3 x n) in a region to be kept free.
  double InKeepFree(const Eigen::Matrix3Xd& skin) const;
  /// Score of where a hand touches (contacts) and what it covers (skin, 3 x n): 0 for the best,
  /// else negative.
  double PlaceScore(std::span<const GraspContact> contacts, const Eigen::Matrix3Xd& skin) const;
};

/// Infers the use of a mesh (meters, standing or lying z-up where this is known) from its distances
/// and handles. If `wanted` is given, only that use is tried; kAny if no part of the mesh fits it.
/// Parts are searched in this order: loops (FindHandles); a round barrel out of the wide face of a
/// body (camera); boxes (occupancy of the box of the dominant normals), thin ones as phones, whose
/// screen is the flatter face; openings (surface with free space straight up and none to any side);
/// bars (the longest run of slices, over all directions, that a hand closes around, with something
/// else beyond it); surfaces of revolution. Deterministic; never throws for a mesh with area, open
/// or in pieces.
ObjectUse FindUse(const TriangleMesh& mesh, const DistanceGrid& object,
                  std::span<const Handle> handles, std::optional<GraspUse> wanted = {});

}  // namespace holdfast
