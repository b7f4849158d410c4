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
#include "solver/grasp/object_shape.h"

namespace holdfast {

/// What an object is for, as far as it matters to how people take it.
enum class GraspUse {
  kAny,     ///< any firm grasp will do
  kHandle,  ///< by the bar of a loop: mug, jug, scissors
  kTool,    ///< by the grip, the thumb's side towards the head: hammer, knife, pan, drill
  kVessel,  ///< upright, from the side, the opening or the neck free: bottle, can, glass
  kBox,     ///< across the narrow side
  kDish,    ///< level, by the rim: bowl, plate
};
std::string_view UseName(GraspUse use);
/// "any", "handle", "tool", "vessel", "box" or "dish"; nothing for any other name.
std::optional<GraspUse> UseByName(std::string_view name);
/// --use: a UseName, or "auto" for nothing.
void AddUseOption(OptionTable& table, std::optional<GraspUse>& use);

/// Part of space around an axis, object frame, meters.
struct UseZone {
  Eigen::Vector3d base, axis;        ///< the axis is unit
  double low, high;                  ///< along the axis, from `base`
  double inner = 0.0, radius = 1e3;  ///< from the axis
  /// 1 inside, 0 farther than `soft_m` outside, linear between.
  double Share(const Eigen::Vector3d& point, double soft_m) const;
};

/// How people take an object, found from its shape. Directions are unit, or zero where it does not
/// matter; object frame. Const and shared by threads.
struct ObjectUse {
  GraspUse kind = GraspUse::kAny;
  std::optional<UseZone> hold;             ///< where contacts belong
  std::optional<Eigen::Vector3d> held_at;  ///< the middle of the hold; none: the centroid
  bool held_anywhere = false;              ///< a rim: no place of it is nearer to the middle
  std::vector<UseZone> keep_free;          ///< no skin here: opening, blade, head
  std::vector<Eigen::Vector3d> press;      ///< forces along one of these
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  double up_weight = 0.0;  ///< how much it must stay so, 0: as for any object
  Eigen::Vector3d thumb = Eigen::Vector3d::Zero();  ///< where the thumb's side of the hand is
  Eigen::Vector3d ahead = Eigen::Vector3d::Zero();  ///< where the hand points, wrist to knuckles

  /// In [0, 1]: whether the surface there is where people touch it.
  double HoldWeight(const Eigen::Vector3d& point) const;
  /// In [0, 1]: how welcome two opposed places are that a hand presses together.
  double OppositionWeight(const Eigen::Vector3d& center, const Eigen::Vector3d& axis) const;
  /// What is lost by how a hand is turned: 0 for the best, negative. `across` is the unit direction
  /// to the thumb's side, `forward` from the wrist to the knuckles, object frame.
  double DirectionScore(const Eigen::Vector3d& across, const Eigen::Vector3d& forward) const;
  /// What is lost by where a hand touches (contacts) and what it covers (skin, 3 x n): 0 for the
  /// best, negative.
  double PlaceScore(std::span<const GraspContact> contacts, const Eigen::Matrix3Xd& skin) const;
};

/// Finds the use of a mesh (meters, standing or lying z-up where it can be told) with its distances
/// and handles; `wanted` none: of what kind it is, too. The parts looked for, in this order: loops
/// (FindHandles); boxes (occupancy of the box of the dominant normals); openings (surface from
/// which straight up is free and every way across is not); grips (the longest run of slices, over
/// all directions, that a hand closes around, with something else beyond it); surfaces that turning
/// about an axis carries onto themselves. A wanted kind that nothing of it fits is kAny.
/// Deterministic; never throws for a mesh with area, open or in pieces.
ObjectUse FindUse(const TriangleMesh& mesh, const DistanceGrid& object,
                  std::span<const Handle> handles, std::optional<GraspUse> wanted = {});

/// How an object is taken for each kind of use; nothing where its shape is not of that kind.
/// `wanted`: it was asked for, so that less of a likeness will do.
std::optional<ObjectUse> AsHandle(const ObjectShape& shape, const ObjectOpening& opening,
                                  std::span<const Handle> handles);
std::optional<ObjectUse> AsBox(const ObjectShape& shape, const ObjectBox& box, bool wanted);
std::optional<ObjectUse> AsTool(const ObjectShape& shape, const ObjectOpening& opening,
                                bool wanted);
std::optional<ObjectUse> AsVessel(const ObjectShape& shape, const ObjectOpening& opening,
                                  bool wanted);
std::optional<ObjectUse> AsDish(const ObjectShape& shape, const ObjectOpening& opening,
                                bool wanted);

}  // namespace holdfast
