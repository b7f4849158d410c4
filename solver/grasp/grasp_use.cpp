// SPDX-License-Identifier: MIT
#include "solver/grasp/grasp_use.h"

#include <algorithm>
#include <cmath>

#include "solver/grasp/use_by_kind.h"

namespace holdfast {

std::string_view UseName(GraspUse use) {
  switch (use) {
    case GraspUse::kAny:
      return "any";
    case GraspUse::kHandle:
      return "handle";
    case GraspUse::kTool:
      return "tool";
    case GraspUse::kVessel:
      return "vessel";
    case GraspUse::kBox:
      return "box";
    case GraspUse::kDish:
      return "dish";
  }
  return "";
}

std::optional<GraspUse> UseByName(std::string_view name) {
  for (const GraspUse use : {GraspUse::kAny, GraspUse::kHandle, GraspUse::kTool, GraspUse::kVessel,
                             GraspUse::kBox, GraspUse::kDish}) {
    if (UseName(use) == name) return use;
  }
  return std::nullopt;
}

double UseZone::Share(const Eigen::Vector3d& point, double soft_m) const {
  const Eigen::Vector3d apart = point - base;
  const double s = apart.dot(axis), r = (apart - s * axis).norm();
  const double outside = std::max({0.0, low - s, s - high, inner - r, r - radius});
  return std::max(0.0, 1.0 - outside / soft_m);
}

double ObjectUse::HoldWeight(const Eigen::Vector3d& point) const {
  constexpr double kSoft = 0.03;
  double weight = hold ? hold->Share(point, kSoft) : 1.0;
  for (const UseZone& zone : keep_free) weight = std::min(weight, 1.0 - zone.Share(point, 0.005));
  return weight;
}

double ObjectUse::OppositionWeight(const Eigen::Vector3d& center,
                                   const Eigen::Vector3d& axis) const {
  double along = press.empty() ? 1.0 : 0.0;
  for (const Eigen::Vector3d& way : press) along = std::max(along, std::abs(way.dot(axis)));
  // A hand around something that stands presses level.
  if (kind == GraspUse::kVessel) along = std::min(along, 1.0 - std::abs(axis.dot(up)));
  return std::exp(-2.0 * (1.0 - HoldWeight(center)) - 1.5 * (1.0 - along));
}

double ObjectUse::DirectionScore(const Eigen::Vector3d& across,
                                 const Eigen::Vector3d& forward) const {
  double score = 0.0;
  if (!thumb.isZero()) score += 0.6 * (across.dot(thumb) - 1.0);
  if (!ahead.isZero()) {
    // A card is taken from either of its long edges.
    const double along = forward.dot(ahead);
    score += 0.6 * ((kind == GraspUse::kBox ? std::abs(along) : along) - 1.0);
  }
  return score;
}

double ObjectUse::PlaceScore(std::span<const GraspContact> contacts,
                             const Eigen::Matrix3Xd& skin) const {
  double score = 0.0;
  if (!contacts.empty()) {
    double held = 0.0, along = 0.0;
    for (const GraspContact& contact : contacts) {
      held += HoldWeight(contact.point);
      double most = press.empty() ? 1.0 : 0.0;
      for (const Eigen::Vector3d& way : press)
        most = std::max(most, std::abs(way.dot(contact.inward)));
      along += most;
    }
    const auto count = static_cast<double>(contacts.size());
    score += 1.5 * (held / count - 1.0) + 1.0 * (along / count - 1.0);
  }
  if (!keep_free.empty()) {
    double covered = 0.0;
    for (Eigen::Index i = 0; i < skin.cols(); ++i) {
      for (const UseZone& zone : keep_free) covered += zone.Share(skin.col(i), 0.003);
    }
    score -= std::min(1.5, 6.0 * covered / static_cast<double>(skin.cols()));
  }
  return score;
}

ObjectUse FindUse(const TriangleMesh& mesh, const DistanceGrid& object,
                  std::span<const Handle> handles, std::optional<GraspUse> wanted) {
  if (wanted == GraspUse::kAny || mesh.NumFaces() == 0 || !(SurfaceArea(mesh) > 0.0)) return {};
  const ObjectShape shape(mesh, object);
  const ObjectOpening opening = FindOpening(shape);
  const bool forced = wanted.has_value();
  const auto asked = [&](GraspUse use) { return !wanted || *wanted == use; };
  std::optional<ObjectUse> use;
  if (asked(GraspUse::kHandle)) use = AsHandle(shape, opening, handles);
  if (!use && !forced && IsBall(shape)) return {};
  if (!use && asked(GraspUse::kBox)) use = AsBox(shape, FindBox(shape), forced);
  // Before tools: a glass has a stem and a bottle a neck.
  if (!use && asked(GraspUse::kVessel)) use = AsVessel(shape, opening, forced);
  if (!use && asked(GraspUse::kTool)) use = AsTool(shape, opening, forced);
  if (!use && asked(GraspUse::kDish)) use = AsDish(shape, opening, forced);
  return use.value_or(ObjectUse{});
}

void AddUseOption(OptionTable& table, std::optional<GraspUse>& use) {
  table.Choice("use", use,
               {{"auto", std::nullopt},
                {"handle", GraspUse::kHandle},
                {"tool", GraspUse::kTool},
                {"vessel", GraspUse::kVessel},
                {"box", GraspUse::kBox},
                {"dish", GraspUse::kDish},
                {"any", GraspUse::kAny}},
               "How people take such an object: handle (by its loop), tool (by the grip, thumb "
               "towards the head), vessel (upright, rim free), box (across the narrow side), dish "
               "(level, by the rim), any (wherever it is firmest), or auto: judged by its shape");
}

}  // namespace holdfast
