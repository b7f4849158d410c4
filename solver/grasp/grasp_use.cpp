// SPDX-License-Identifier: MIT
#include "solver/grasp/grasp_use.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include <Eigen/Geometry>

#include "solver/grasp/object_shape.h"

namespace holdfast {

std::string_view UseName(GraspUse use) {
  constexpr std::array<std::string_view, 8> kNames = {"any", "handle", "tool",   "vessel",
                                                      "box", "dish",   "camera", "phone"};
  return kNames[static_cast<std::size_t>(use)];
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
  // A hand around a standing object presses horizontally.
  if (kind == GraspUse::kVessel) along = std::min(along, 1.0 - std::abs(axis.dot(up)));
  return std::exp(-2.0 * (1.0 - HoldWeight(center)) - 1.5 * (1.0 - along));
}

double ObjectUse::DirectionScore(const Eigen::Vector3d& across, const Eigen::Vector3d& forward,
                                 const Eigen::Vector3d& facing) const {
  double score = 0.0;
  if (!thumb.isZero()) score += 0.6 * (across.dot(thumb) - 1.0);
  if (!ahead.isZero()) {
    // A phone is grasped at either long edge.
    const double along = forward.dot(ahead);
    score += 0.6 * ((kind == GraspUse::kPhone ? std::abs(along) : along) - 1.0);
  }
  if (!palm.isZero()) score += 0.6 * (facing.dot(palm) - 1.0);
  return score;
}

double ObjectUse::InKeepFree(const Eigen::Matrix3Xd& skin) const {
  constexpr double kSoft = 0.003;
  double covered = 0.0;
  for (Eigen::Index i = 0; i < skin.cols(); ++i) {
    double most = 0.0;
    for (const UseZone& zone : keep_free) most = std::max(most, zone.Share(skin.col(i), kSoft));
    covered += most;
  }
  return covered / static_cast<double>(std::max<Eigen::Index>(1, skin.cols()));
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
  return score - std::min(1.5, keep_free_weight * InKeepFree(skin));
}

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kWidestHold = 0.104;  // span of a hand
constexpr double kHandBreadth = 0.09;

// Region above a rim: neither fingers in the contents nor a palm on the rim.
UseZone Above(const ObjectOpening& opening, double below_rim) {
  return {opening.middle - opening.middle.dot(opening.up) * opening.up,
          opening.up,
          opening.rim - below_rim,
          opening.rim + 0.2,
          0.0,
          opening.radius + 0.012};
}

// Up direction of an object standing along `axis`: z if parallel, else towards the lighter end.
Vector3d UpAlong(const ObjectShape& shape, const Vector3d& axis) {
  if (std::abs(axis.z()) > 0.9) return axis.z() > 0.0 ? axis : Vector3d(-axis);
  const bool heavy_above = axis.dot(shape.centroid) > shape.Along(axis).Middle();
  return heavy_above ? Vector3d(-axis) : axis;
}

// How an object is grasped for each kind of use; nothing if its shape is not of that kind.
// `wanted`: the use was requested, so the criteria are looser.
std::optional<ObjectUse> AsHandle(const ObjectShape& shape, const ObjectOpening& opening,
                                  std::span<const Handle> handles) {
  if (handles.empty()) return std::nullopt;
  ObjectUse use;
  use.kind = GraspUse::kHandle;
  use.up_weight = 3.0;
  Vector3d bars = Vector3d::Zero();
  double flat = 0.0;
  for (const Handle& handle : handles) {
    bars += handle.bar / static_cast<double>(handles.size());
    flat += std::abs(handle.through.z()) / static_cast<double>(handles.size());
  }
  if (opening.Any()) {
    use.up = opening.up;
    use.keep_free.push_back(Above(opening, 0.004));
  }
  if (flat > 0.8 && !opening.Any()) {
    // Lies on its side (scissors, clamps): the part opposite the loops points away from the wrist.
    const Vector3d away = shape.middle - bars;
    use.up_weight = 1.0;
    const Vector3d level = away - away.z() * Vector3d::UnitZ();
    if (level.norm() > 0.02) use.thumb = level.normalized();
  } else if (std::abs(handles.front().along.dot(use.up)) > 0.5) {
    use.thumb = use.up;
  }
  return use;
}

std::optional<ObjectUse> AsBox(const ObjectShape& shape, const ObjectBox& box, bool wanted) {
  const bool is_box = box.filled > 0.87 || (box.filled > 0.65 && box.square > 0.75);
  if (!(wanted ? box.filled > 0.5 : is_box) || box.side[2] > 0.095) return std::nullopt;
  if (!wanted && box.side[2] < 0.004) return std::nullopt;  // a sheet
  ObjectUse use;
  use.kind = GraspUse::kBox;
  use.palm_worth = 0.5;
  const double across = box.side[2];
  for (int k = 2; k >= 0; --k) {
    if (box.side[k] < 1.15 * across && box.side[k] < 0.095) use.press.push_back(box.axes.col(k));
  }
  for (int k = 0; k < 3; ++k) {
    const Vector3d axis = box.axes.col(k);
    if (std::abs(axis.z()) < 0.9) continue;
    if (k == 2) break;
    use.up_weight = 3.0;
    // The hand comes from the side, halfway up, thumb above; a wide box is grasped near an edge.
    constexpr double kFromEdge = 0.055;
    const double half = std::max(0.05, 0.25 * box.side[k]);
    const Vector3d up = axis.z() > 0.0 ? axis : Vector3d(-axis);
    const double middle = shape.Along(up).Middle();
    use.thumb = up;
    use.hold = UseZone{shape.middle - shape.middle.dot(up) * up, up, middle - half, middle + half,
                       std::max(0.0, 0.5 * box.side[1 - k] - kFromEdge)};
  }
  return use;
}

// Fraction of the surface within 0.6 mm of the extreme plane along `out`.
double FlatAt(const ObjectShape& shape, const Vector3d& out) {
  const Eigen::RowVectorXd along = out.transpose() * shape.points;
  const double top = shape.Along(out).high;
  return (along.array() > top - 0.0006).cast<double>().mean();
}

std::optional<ObjectUse> AsPhone(const ObjectShape& shape, const ObjectBox& box, bool wanted) {
  const bool is_box = box.filled > 0.87 || (box.filled > 0.65 && box.square > 0.75);
  if (!(wanted ? box.filled > 0.5 : is_box)) return std::nullopt;
  if (box.side[2] > (wanted ? 0.03 : 0.02) || box.side[1] > 0.095) return std::nullopt;
  if (!wanted && box.side[2] < 0.004) return std::nullopt;  // a sheet
  ObjectUse use;
  use.kind = GraspUse::kPhone;
  use.up_over_clip = true;
  use.palm_worth = 1.0;
  use.press.push_back(box.axes.col(1));
  // The screen is the flatter face: lenses protrude from the back. Equal faces: the one on top.
  const Vector3d up = box.axes.col(2).z() < 0.0 ? Vector3d(-box.axes.col(2)) : box.axes.col(2);
  const double above = FlatAt(shape, up), below = FlatAt(shape, -up);
  const bool lies_on_screen = above < 0.6 * below;
  const Vector3d screen = lies_on_screen ? Vector3d(-up) : up;
  use.palm = screen;
  use.ahead = box.axes.col(1);
  use.up = screen;
  use.up_weight = 0.5;
  // The thumb's side points towards the lenses.
  const Vector3d along = box.axes.col(0);
  double off = 0.0;
  int lenses = 0;
  const double back = shape.Along(-screen).high;
  for (Eigen::Index i = 0; i < shape.points.cols(); ++i) {
    if (-screen.dot(shape.points.col(i)) < back - 0.0006) continue;
    off += along.dot(shape.points.col(i) - shape.middle);
    ++lenses;
  }
  if (lenses > 0 && std::abs(off / lenses) > 0.15 * box.side[0]) {
    use.thumb = off > 0.0 ? along : Vector3d(-along);
  }
  const Vector3d line = shape.middle - shape.middle.dot(screen) * screen;
  const double top = shape.Along(screen).high;
  use.keep_free.push_back({line, screen, top + 0.002, top + 0.2, 0.0, 0.4 * box.side[1]});
  use.keep_free_weight = 10.0;
  return use;
}

// A camera's lens: the round part in front of the wide face of a body.
struct Lens {
  Vector3d out;     // its axis
  Vector3d line;    // a point of the axis, at 0 along it
  double radius;    // largest
  AxisSpan barrel;  // along `out`
  AxisSpan body;
};

std::optional<Lens> FindLens(const ObjectShape& shape, const Vector3d& out, bool wanted) {
  constexpr int kSlices = 30;
  constexpr double kMinWidth = 0.03, kMaxWidth = 0.11, kMinLength = 0.012, kMaxLength = 0.16;
  const ShapeSlices slices = CutIntoSlices(shape, out, kSlices);
  int first = kSlices;  // of the barrel; the last slice is at its front
  double radius = 0.0;
  Vector3d line = Vector3d::Zero();
  for (int k = kSlices - 1; k >= 0; --k) {
    const ShapeSlice& slice = slices.at[k];
    if (slice.count < 8 || slice.wide > kMaxWidth || slice.narrow < 0.87 * slice.wide) break;
    const Vector3d center = slice.center - slice.center.dot(out) * out;
    if (first < kSlices && (center - line / (kSlices - first)).norm() > 0.006) break;
    line += center;
    radius = std::max(radius, 0.5 * slice.wide);
    first = k;
  }
  const double length = (kSlices - first) * slices.Step();
  if (first == kSlices || 2.0 * radius < kMinWidth || length < kMinLength || length > kMaxLength) {
    return std::nullopt;
  }
  line /= kSlices - first;
  // The body: wider than the barrel, oblong, about as high as the barrel, as thick as a hand spans.
  double wide = 0.0, narrow = 0.0;
  int count = 0;
  for (int k = 0; k < first; ++k) {
    if (slices.at[k].count < 4) continue;
    wide += slices.at[k].wide;
    narrow += slices.at[k].narrow;
    ++count;
  }
  if (count == 0) return std::nullopt;
  wide /= count;
  narrow /= count;
  const double thick = slices.Low(first) - slices.span.low;
  const double wider = wanted ? 1.1 : 1.3;
  if (wide < wider * 2.0 * radius || wide > 0.2 || narrow > 0.9 * wide) return std::nullopt;
  if (narrow < 1.4 * radius || thick < 0.015 || thick > 0.08) return std::nullopt;
  return Lens{out,
              line,
              radius,
              {slices.Low(first), slices.span.high},
              {slices.span.low, slices.Low(first)}};
}

std::optional<ObjectUse> AsCamera(const ObjectShape& shape, const ObjectBox& box, bool wanted) {
  std::optional<Lens> lens;
  for (const Matrix3d& axes : {Matrix3d(Matrix3d::Identity()), box.axes}) {
    for (int k = 0; k < 6 && !lens; ++k) {
      if (axes.col(k % 3).norm() < 0.5) continue;  // the box was not found
      lens = FindLens(shape, (k < 3 ? 1.0 : -1.0) * axes.col(k % 3), wanted);
    }
  }
  if (!lens) return std::nullopt;
  const Vector3d& out = lens->out;
  ObjectUse use;
  use.kind = GraspUse::kCamera;
  use.up_over_clip = true;
  use.palm_worth = 1.0;
  const Vector3d level = Vector3d::UnitZ() - out.z() * out;
  // On its back, the camera's up is across its longer side; either way will do.
  use.up = level.norm() > 0.5 ? Vector3d(level.normalized())
                              : Vector3d(box.axes.col(1) - box.axes.col(1).dot(out) * out);
  if (use.up.norm() < 0.5) use.up = out.unitOrthogonal();
  use.up.normalize();
  use.up_weight = 2.0;
  use.thumb = use.up;
  use.ahead = out;
  const Vector3d aside = out.cross(use.up);
  use.press = {out, aside};
  // At half the body's height, on either side of the barrel.
  constexpr double kView = 0.03, kBesideMiddle = 0.008;
  const Vector3d middle = lens->line + lens->body.Middle() * out;
  const double half = 0.5 * shape.Along(aside).Length();
  use.hold = UseZone{middle,      aside, -half - 0.01,
                     half + 0.01, 0.0,   0.5 * lens->body.Length() + kBesideMiddle};
  use.held_anywhere = true;
  use.keep_free.push_back({lens->line, out, lens->barrel.low + 0.004, lens->barrel.high + 0.3, 0.0,
                           lens->radius + 0.003});
  use.keep_free.push_back(
      {lens->line, out, lens->body.low - 0.2, lens->body.low - 0.001, 0.0, kView});
  use.keep_free_weight = 30.0;
  return use;
}

std::optional<ObjectUse> AsTool(const ObjectShape& shape, const ObjectOpening& opening,
                                bool wanted) {
  const ObjectBar bar = FindBar(shape);
  if (bar.last - bar.first < 2 || bar.Length() < (wanted ? 0.03 : 0.04)) return std::nullopt;
  const ShapeSlices& slices = bar.slices;
  const Vector3d &axis = slices.axis, &line = bar.line;
  const double whole = slices.span.Length(), wide = bar.wide;
  const AxisSpan run = bar.Run();
  const std::array<BeyondBar, 2>& ends = bar.ends;
  int head = ends[1].Bulk() > ends[0].Bulk() ? 1 : 0;
  bool has_head = ends[head].length > 0.25 * bar.Length() || ends[head].reach > 0.8 * wide;
  if (ends[head].Bulk() == 0.0) has_head = false;
  AxisSpan held = run;
  if (!has_head) {
    // A bar as a whole: it is held at the thicker and more even end.
    if (whole < 2.2 * wide || whole < 0.09 || bar.bend > 0.006) return std::nullopt;
    const auto worth = [&](double from, double to) {
      double thick = 0.0, mean = 0.0, square = 0.0;
      int n = 0;
      for (int k = slices.Of(from); k <= slices.Of(to - 1e-6); ++k) {
        thick += std::min(slices.at[k].narrow, 0.03);
        mean += slices.at[k].wide;
        square += slices.at[k].wide * slices.at[k].wide;
        ++n;
      }
      mean /= n;
      return thick / n / (1.0 + 4.0 * std::sqrt(std::max(0.0, square / n - mean * mean)) / mean);
    };
    const double part = 0.45 * run.Length();
    const double low = worth(run.low, run.low + part), high = worth(run.high - part, run.high);
    if (std::max(low, high) < 1.15 * std::min(low, high)) {
      if (!wanted) return std::nullopt;
    } else {
      has_head = true;
      head = low > high ? 1 : 0;
    }
    held = head == 1 ? AxisSpan{run.low, run.low + 0.6 * run.Length()}
                     : AxisSpan{run.high - 0.6 * run.Length(), run.high};
  }
  const double sign = head == 1 ? 1.0 : -1.0;
  ObjectUse use;
  use.kind = GraspUse::kTool;
  // A bar as thick as a finger is grasped with the whole hand; thinner ones are also pinched.
  constexpr double kFingerWide = 0.018;
  if (wide > kFingerWide) use.palm_worth = 1.0;
  const bool pinned = ends[1 - head].Bulk() > 0.0;  // something at the other end, too
  // A hand's breadth, near the end but not beyond it.
  const double breadth = std::min(kHandBreadth, held.Length());
  const double from_end = (pinned ? 0.5 : 0.15) * (held.Length() - breadth);
  const double start = head == 1 ? held.low + from_end : held.high - from_end - breadth;
  use.hold = UseZone{line, axis, start - 0.005, start + breadth + 0.005};
  use.held_at = line + (start + 0.5 * breadth) * axis;
  if (!has_head) return use;
  use.thumb = sign * axis;
  const Vector3d& off = ends[head].off;
  // Pistol grip: the head protrudes far, and farther to one side. With a battery at the other end,
  // a smaller offset suffices.
  const double reach = ends[head].reach;
  const bool stands_out = reach > std::max(0.045, 1.5 * wide);
  if (opening.Any()) {  // a pan
    use.up = opening.up;
    use.up_weight = 1.0;
    use.up_over_clip = true;
  } else if (stands_out && off.norm() > (bar.Waist() ? 0.004 : std::max(0.012, 0.15 * reach))) {
    use.ahead = off.normalized();
    use.up = use.thumb;
    use.up_weight = 1.0;
    use.up_over_clip = true;
  }
  return use;
}

std::optional<ObjectUse> AsVessel(const ObjectShape& shape, const ObjectOpening& opening,
                                  bool wanted) {
  // Candidate axes: that of the opening, z, and the principal axes.
  std::vector<Vector3d> axes;
  if (opening.Any()) axes.push_back(opening.up);
  axes.push_back(Vector3d::UnitZ());
  for (int k = 0; k < 3; ++k) axes.push_back(shape.axes.col(k));
  for (const Vector3d& axis : axes) {
    const bool open = opening.Any() && std::abs(axis.dot(opening.up)) > 0.9;
    const ShapeSlices slices = CutIntoSlices(shape, axis, 24);
    std::vector<double> narrow, wide;
    for (const ShapeSlice& slice : slices.at) {
      if (slice.count < 4) continue;
      narrow.push_back(slice.narrow);
      wide.push_back(slice.wide);
    }
    if (narrow.empty()) continue;
    const double widest = *std::max_element(wide.begin(), wide.end());
    const bool straight = std::ranges::all_of(slices.at, [&](const ShapeSlice& slice) {
      const Vector3d apart = slice.center - shape.middle;
      return slice.count < 4 || (apart - apart.dot(axis) * axis).norm() < 0.015;
    });
    std::nth_element(narrow.begin(), narrow.begin() + narrow.size() / 2, narrow.end());
    const double thick = narrow[narrow.size() / 2];
    const double height = slices.span.Length();
    const bool round = Roundness(shape, axis, shape.middle) > 0.75;
    if (thick > kWidestHold || (!open && (widest < 0.042 || thick < (round ? 0.034 : 0.045))))
      continue;
    const bool tall = height > (open ? 0.6 : round ? 1.05 : 1.4) * widest;
    if (!wanted && (!tall || !(round || open || (straight && widest < kWidestHold)))) continue;
    if (wanted && height < 0.5 * widest) continue;
    ObjectUse use;
    use.kind = GraspUse::kVessel;
    use.palm_worth = 1.0;
    use.up = open ? opening.up : UpAlong(shape, axis);
    use.up_weight = 3.0;
    const AxisSpan stand = shape.Along(use.up);
    const double top = stand.high;
    // Below the part to drink from or unscrew, above the table.
    const double low = stand.low + 0.12 * height;
    const double high = top - std::clamp(0.2 * height, 0.015, 0.06);
    const Vector3d line = shape.middle - shape.middle.dot(use.up) * use.up;
    use.hold = UseZone{line, use.up, low, high};
    use.held_at = line + std::clamp(use.up.dot(shape.centroid), low + 0.2 * (high - low),
                                    high - 0.2 * (high - low)) *
                             use.up;
    use.keep_free.push_back({line, use.up, top - 0.004, top + 0.25});
    use.keep_free.push_back({line, use.up, stand.low - 0.25, stand.low + 0.002});
    if (!round && widest > 1.25 * thick) {
      // Across the narrow side.
      double least = 1e9;
      Vector3d across = Vector3d::Zero();
      const Vector3d x = use.up.unitOrthogonal(), y = use.up.cross(x);
      for (int w = 0; w < 36; ++w) {
        const double angle = std::numbers::pi * w / 36;
        const Vector3d way = std::cos(angle) * x + std::sin(angle) * y;
        const double width = shape.Along(way).Length();
        if (width < least) {
          least = width;
          across = way;
        }
      }
      use.press.push_back(across);
    }
    return use;
  }
  return std::nullopt;
}

std::optional<ObjectUse> AsDish(const ObjectShape& shape, const ObjectOpening& opening,
                                bool wanted) {
  ObjectUse use;
  use.kind = GraspUse::kDish;
  use.up_weight = 3.0;
  use.held_anywhere = true;
  const Vector3d flat = shape.axes.col(2);
  if (opening.Any()) {
    use.up = opening.up;
  } else {
    use.up = flat.z() < 0.0 ? Vector3d(-flat) : flat;
  }
  const AxisSpan stand = shape.Along(use.up);
  const Vector3d line = shape.middle - shape.middle.dot(use.up) * use.up;
  double radius = 0.0, least = 1e9;
  const Vector3d x = use.up.unitOrthogonal(), y = use.up.cross(x);
  for (int w = 0; w < 12; ++w) {
    const double angle = std::numbers::pi * w / 12;
    const double width = shape.Along(std::cos(angle) * x + std::sin(angle) * y).Length();
    radius = std::max(radius, 0.5 * width);
    least = std::min(least, 0.5 * width);
  }
  if (!wanted && (2.0 * least < kWidestHold || stand.Length() > 1.4 * least)) return std::nullopt;
  if (!opening.Any() && stand.Length() > 0.045) return std::nullopt;
  // The rim: top of the wall of a bowl, edge of a plate.
  const double deep = opening.Any() ? std::max(0.5 * (opening.rim - opening.floor), 0.02) : 1.0;
  use.hold = UseZone{line, use.up, stand.high - deep, stand.high + 0.01, least - 0.035};
  if (stand.Length() < 0.045) use.press.push_back(use.up);
  return use;
}

}  // namespace

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
  if (!use && (asked(GraspUse::kCamera) || asked(GraspUse::kPhone) || asked(GraspUse::kBox))) {
    const ObjectBox box = FindBox(shape);
    if (asked(GraspUse::kCamera)) use = AsCamera(shape, box, forced);
    if (!use && asked(GraspUse::kPhone)) use = AsPhone(shape, box, forced);
    if (!use && asked(GraspUse::kBox)) use = AsBox(shape, box, forced);
  }
  // Before tools, since a glass has a stem and a bottle a neck.
  if (!use && asked(GraspUse::kVessel)) use = AsVessel(shape, opening, forced);
  if (!use && asked(GraspUse::kTool)) use = AsTool(shape, opening, forced);
  if (!use && asked(GraspUse::kDish)) use = AsDish(shape, opening, forced);
  return use.value_or(ObjectUse{});
}

void AddUseOption(OptionTable& table, std::optional<GraspUse>& use) {
  table.Choice(
      "use", use,
      {{"auto", std::nullopt},
       {"handle", GraspUse::kHandle},
       {"tool", GraspUse::kTool},
       {"vessel", GraspUse::kVessel},
       {"box", GraspUse::kBox},
       {"dish", GraspUse::kDish},
       {"camera", GraspUse::kCamera},
       {"phone", GraspUse::kPhone},
       {"any", GraspUse::kAny}},
      "How people hold this kind of object: handle (by its loop), tool (by the grip, thumb toward "
      "the head), vessel (upright, rim free), box (across the narrow side), dish (level, by the "
      "rim), camera (by the side of its body, lens free), phone (its back in the palm, screen "
      "free), any (the firmest grasp anywhere), or auto (inferred from its shape)");
}

}  // namespace holdfast
