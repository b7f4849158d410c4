// SPDX-License-Identifier: MIT
#include "solver/grasp/grasp_use.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

#include "geometry/rotation.h"
#include "solver/grasp/grasp_candidates.h"

namespace holdfast {
namespace {

using Eigen::Matrix3d;
using Eigen::Matrix3Xd;
using Eigen::Vector3d;

constexpr int kUsePoints = 3000;
constexpr double kWidestHold = 0.104;    // what a hand spans
constexpr double kThickestGrip = 0.066;  // a bar's cross-section, its longer side
constexpr double kThinnestGrip = 0.006;
constexpr double kHandBreadth = 0.09;

struct Span {
  double low, high;
  double Length() const { return high - low; }
  double Middle() const { return 0.5 * (low + high); }
};

// What is asked of a mesh again and again.
struct UseShape {
  const TriangleMesh& mesh;
  const DistanceGrid& object;
  Matrix3Xd points;   // all over the surface
  Vector3d middle;    // of them
  Vector3d centroid;  // of the solid
  Matrix3d axes;      // of inertia of the surface, the longest first

  Span Along(const Vector3d& axis) const {
    const Eigen::RowVectorXd s = axis.transpose() * mesh.vertices;
    return {s.minCoeff(), s.maxCoeff()};
  }
};

UseShape ShapeOf(const TriangleMesh& mesh, const DistanceGrid& object) {
  UseShape shape{mesh, object, SampleSurface(mesh, kUsePoints, 0), {}, SolidCentroid(mesh), {}};
  shape.middle = shape.points.rowwise().mean();
  const Matrix3Xd apart = shape.points.colwise() - shape.middle;
  const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(apart * apart.transpose());
  shape.axes = eigen.eigenvectors().rowwise().reverse();
  return shape;
}

// ---- slices

struct Slice {
  int count = 0;
  double narrow = 0.0, wide = 0.0;  // least and largest width across the axis
  Vector3d center = Vector3d::Zero();
};

struct Slices {
  Vector3d axis;
  Span span;
  std::vector<Slice> at;

  double Step() const { return span.Length() / static_cast<double>(at.size()); }
  double Low(int k) const { return span.low + k * Step(); }
  int Of(double s) const {
    return std::clamp(static_cast<int>((s - span.low) / Step()), 0,
                      static_cast<int>(at.size()) - 1);
  }
};

Slices Cut(const UseShape& shape, const Vector3d& axis, int count) {
  constexpr int kWays = 8;
  Slices slices{axis, shape.Along(axis), std::vector<Slice>(count)};
  const Vector3d x = axis.unitOrthogonal(), y = axis.cross(x);
  Eigen::Matrix<double, kWays, 3> ways;
  for (int w = 0; w < kWays; ++w) {
    const double angle = std::numbers::pi * w / kWays;
    ways.row(w) = std::cos(angle) * x + std::sin(angle) * y;
  }
  const Eigen::Matrix<double, kWays, Eigen::Dynamic> across = ways * shape.points;
  const Eigen::RowVectorXd along = axis.transpose() * shape.points;
  using Widths = Eigen::Array<double, kWays, 1>;
  std::vector<Widths> low(count, Widths::Constant(1e9)), high(count, Widths::Constant(-1e9));
  for (Eigen::Index i = 0; i < shape.points.cols(); ++i) {
    const int k = slices.Of(along(i));
    low[k] = low[k].min(across.col(i).array());
    high[k] = high[k].max(across.col(i).array());
    ++slices.at[k].count;
  }
  for (int k = 0; k < count; ++k) {
    Slice& slice = slices.at[k];
    if (slice.count == 0) continue;
    slice.narrow = (high[k] - low[k]).minCoeff();
    slice.wide = (high[k] - low[k]).maxCoeff();
    // The middle of the box along x and y (ways 0 and kWays / 2).
    slice.center = 0.5 * (low[k](0) + high[k](0)) * x +
                   0.5 * (low[k](kWays / 2) + high[k](kWays / 2)) * y +
                   (slices.Low(k) + 0.5 * slices.Step()) * axis;
  }
  return slices;
}

// ---- grips

// What is beyond a grip at one end, and how far it stands out.
struct Beyond {
  double length = 0.0, reach = 0.0;
  int count = 0;
  Vector3d off = Vector3d::Zero();  // the middle of it, from the grip's line

  double Bulk() const { return length < 0.012 ? 0.0 : length + reach; }
};

struct Grip {
  Slices slices;
  int first = 0, last = -1;          // of the run
  Vector3d line = Vector3d::Zero();  // a point of its middle line, at 0 along the axis
  double wide = 0.0;                 // mean
  double bend = 0.0;                 // how far its middles are from a straight line
  std::array<Beyond, 2> ends;        // below, above

  double Length() const { return (last - first + 1) * slices.Step(); }
  Span Run() const { return {slices.Low(first), slices.Low(last + 1)}; }
  // Thin between two things that stand out.
  bool Waist() const {
    return std::all_of(ends.begin(), ends.end(), [&](const Beyond& end) {
      return end.length > 0.02 && end.reach > 0.75 * wide;
    });
  }
};

// The longest run of slices that a hand closes around.
Grip LongestRun(Slices slices) {
  Grip grip;
  grip.slices = std::move(slices);
  const auto fits = [&](const Slice& slice) {
    return slice.count >= 4 && slice.wide < kThickestGrip && slice.narrow > kThinnestGrip &&
           slice.narrow < 0.052;
  };
  const int count = static_cast<int>(grip.slices.at.size());
  for (int first = 0; first < count;) {
    int last = first - 1;
    while (last + 1 < count && fits(grip.slices.at[last + 1])) ++last;
    if (last - first > grip.last - grip.first) {
      grip.first = first;
      grip.last = last;
    }
    first = last + 2;
  }
  return grip;
}

void MeasureGrip(const UseShape& shape, Grip& grip) {
  const Slices& slices = grip.slices;
  const int count = grip.last - grip.first + 1;
  for (int k = grip.first; k <= grip.last; ++k) {
    grip.line += slices.at[k].center / count;
    grip.wide += slices.at[k].wide / count;
  }
  grip.line -= grip.line.dot(slices.axis) * slices.axis;
  for (int k = grip.first; k <= grip.last; ++k) {
    const Vector3d& center = slices.at[k].center;
    const Vector3d apart = center - center.dot(slices.axis) * slices.axis - grip.line;
    grip.bend = std::max(grip.bend, apart.norm());
  }
  const Span run = grip.Run();
  grip.ends[0].length = run.low - slices.span.low;
  grip.ends[1].length = slices.span.high - run.high;
  for (Eigen::Index i = 0; i < shape.points.cols(); ++i) {
    const double s = slices.axis.dot(shape.points.col(i));
    if (s > run.low && s < run.high) continue;
    Beyond& end = grip.ends[s > run.low ? 1 : 0];
    const Vector3d apart = shape.points.col(i) - s * slices.axis - grip.line;
    end.off += apart;
    end.reach = std::max(end.reach, apart.norm());
    ++end.count;
  }
  for (Beyond& end : grip.ends) end.off /= std::max(1, end.count);
}

// The direction in which the middles of a run's slices follow each other.
Vector3d LineOf(const Grip& grip) {
  Matrix3Xd centers(3, grip.last - grip.first + 1);
  for (int k = grip.first; k <= grip.last; ++k) {
    centers.col(k - grip.first) = grip.slices.at[k].center;
  }
  const Matrix3Xd apart = centers.colwise() - centers.rowwise().mean();
  const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(apart * apart.transpose());
  return eigen.eigenvectors().col(2);
}

// The longest bar: cuts straight across it, since slanting ones make a blade look thick.
Grip FindGrip(const UseShape& shape) {
  constexpr int kDirections = 90, kSlices = 36;
  constexpr double kStraight = 0.966;
  Grip best;
  double most = -1.0;
  const auto attempt = [&](const Vector3d& axis, bool anyway) {
    Grip grip = LongestRun(Cut(shape, axis, kSlices));
    if (grip.last - grip.first < 2) return;
    if (std::abs(LineOf(grip).dot(axis)) < kStraight) return;
    MeasureGrip(shape, grip);
    const double worth = grip.Length() - grip.wide + (grip.Waist() ? 0.06 : 0.0);
    if (!anyway && worth <= most) return;
    most = worth;
    best = std::move(grip);
  };
  for (int k = 0; k < 3; ++k) attempt(shape.axes.col(k), false);
  for (int i = 0; i < kDirections; ++i) {
    const double z = (i + 0.5) / kDirections, r = std::sqrt(1.0 - z * z);
    const double angle = i * std::numbers::pi * (3.0 - std::sqrt(5.0));
    attempt({r * std::cos(angle), r * std::sin(angle), z}, false);
  }
  for (int round = 0; round < 2 && best.last > best.first; ++round) attempt(LineOf(best), true);
  return best;
}

// ---- openings

struct Opening {
  Vector3d up = Vector3d::UnitZ();
  double share = 0.0;             // of the surface that is inside
  double floor = 0.0, rim = 0.0;  // along up
  Vector3d middle = Vector3d::Zero();
  double radius = 0.0;
  bool Any() const { return share > 0.1 && rim - floor > 0.010; }
};

// Whether a ray meets the object.
bool Meets(const DistanceGrid& object, const Vector3d& from, const Vector3d& way, double farthest) {
  for (double s = 0.0; s < farthest;) {
    const double d = object.Distance(from + s * way);
    if (d < 0.0006) return true;
    s += std::max(d, 0.0005);
  }
  return false;
}

Opening OpeningTowards(const UseShape& shape, const Vector3d& up) {
  constexpr int kStride = 6, kRays = 8;
  constexpr double kOff = 0.006;
  const double size = Extent(shape.mesh).norm();
  const Vector3d x = up.unitOrthogonal(), y = up.cross(x);
  Opening opening;
  opening.up = up;
  opening.floor = std::numeric_limits<double>::infinity();
  opening.rim = -opening.floor;
  std::vector<Vector3d> inside;
  int tried = 0;
  for (Eigen::Index i = 0; i < shape.points.cols(); i += kStride) {
    ++tried;
    Vector3d normal;
    shape.object.Distance(shape.points.col(i), &normal);
    if (normal.norm() < 0.3) continue;
    const Vector3d from = shape.points.col(i) + kOff * normal.normalized();
    if (shape.object.Distance(from) < 0.3 * kOff || Meets(shape.object, from, up, size)) continue;
    bool enclosed = true;
    for (int ray = 0; ray < kRays && enclosed; ++ray) {
      const double angle = 2.0 * std::numbers::pi * ray / kRays;
      enclosed = Meets(shape.object, from, std::cos(angle) * x + std::sin(angle) * y, size);
    }
    if (!enclosed) continue;
    inside.push_back(shape.points.col(i));
    const double height = up.dot(shape.points.col(i));
    opening.floor = std::min(opening.floor, height);
    opening.rim = std::max(opening.rim, height);
    opening.middle += shape.points.col(i);
  }
  if (inside.empty()) return {};
  opening.share = static_cast<double>(inside.size()) / tried;
  opening.middle /= static_cast<double>(inside.size());
  for (const Vector3d& point : inside) {
    const Vector3d apart = point - opening.middle;
    opening.radius = std::max(opening.radius, (apart - apart.dot(up) * up).norm());
  }
  return opening;
}

// Up where it stands if it is open there, else where it is open most.
Opening FindOpening(const UseShape& shape) {
  Opening best = OpeningTowards(shape, Vector3d::UnitZ());
  if (best.Any()) return best;
  best = {};
  for (const Matrix3d& axes : {Matrix3d(Matrix3d::Identity()), shape.axes}) {
    for (int k = 0; k < 6; ++k) {
      const Opening opening = OpeningTowards(shape, (k < 3 ? 1.0 : -1.0) * axes.col(k % 3));
      if (opening.Any() && opening.share > std::max(best.share, 0.18)) best = opening;
    }
  }
  return best;
}

// ---- boxes and surfaces of revolution

struct BoxShape {
  Matrix3d axes;  // the longest side first
  std::array<double, 3> side{};
  double filled = 0.0;  // share of its volume
  double square = 0.0;  // share of the surface that faces along the axes
};

BoxShape FindBox(const UseShape& shape) {
  const TriangleMesh& mesh = shape.mesh;
  Matrix3Xd cross(3, mesh.NumFaces());
  for (Eigen::Index f = 0; f < mesh.NumFaces(); ++f) cross.col(f) = FaceCross(mesh, f);
  const Eigen::RowVectorXd area = cross.colwise().norm();
  // The direction that most of the surface faces, of those orthogonal to `not_this`.
  constexpr int kTried = 200;
  const auto dominant = [&](const Vector3d& not_this) {
    Vector3d best = Vector3d::Zero();
    double most = -1.0;
    const Eigen::Index stride = std::max<Eigen::Index>(1, mesh.NumFaces() / kTried);
    for (Eigen::Index f = 0; f < mesh.NumFaces(); f += stride) {
      Vector3d way = cross.col(f) - cross.col(f).dot(not_this) * not_this;
      if (!(way.norm() > 0.9 * area(f)) || !(area(f) > 0.0)) continue;
      way.normalize();
      const Eigen::RowVectorXd along = (way.transpose() * cross).cwiseAbs();
      const double facing = (along.array() > 0.97 * area.array()).select(area, 0.0).sum();
      if (facing > most) {
        most = facing;
        best = way;
      }
    }
    if (most < 0.0) return Vector3d(Vector3d::Zero());
    Vector3d mean = Vector3d::Zero();
    for (Eigen::Index f = 0; f < mesh.NumFaces(); ++f) {
      const double facing = best.dot(cross.col(f));
      if (std::abs(facing) > 0.97 * area(f)) mean += (facing > 0.0 ? 1.0 : -1.0) * cross.col(f);
    }
    mean -= mean.dot(not_this) * not_this;
    return Vector3d(mean.normalized());
  };
  BoxShape box;
  const Vector3d first = dominant(Vector3d::Zero());
  const Vector3d second = dominant(first);
  if (!(second.norm() > 0.5)) return box;
  Matrix3d axes;
  axes << first, second, first.cross(second);
  std::array<int, 3> order = {0, 1, 2};
  std::array<Span, 3> spans;
  for (int k = 0; k < 3; ++k) spans[k] = shape.Along(axes.col(k));
  std::stable_sort(order.begin(), order.end(),
                   [&](int a, int b) { return spans[a].Length() > spans[b].Length(); });
  for (int k = 0; k < 3; ++k) {
    box.axes.col(k) = axes.col(order[k]);
    box.side[k] = spans[order[k]].Length();
  }
  double square = 0.0;
  for (Eigen::Index f = 0; f < mesh.NumFaces(); ++f) {
    const double most = (axes.transpose() * cross.col(f)).cwiseAbs().maxCoeff();
    if (most > 0.94 * area(f)) square += area(f);
  }
  box.square = square / area.sum();
  constexpr int kCells = 9;
  int filled = 0;
  for (int i = 0; i < kCells * kCells * kCells; ++i) {
    const std::array<int, 3> cell = {i % kCells, i / kCells % kCells, i / (kCells * kCells)};
    Vector3d point = Vector3d::Zero();
    for (int k = 0; k < 3; ++k) {
      point += (spans[k].low + (cell[k] + 0.5) / kCells * spans[k].Length()) * axes.col(k);
    }
    filled += shape.object.Distance(point) < 0.0;
  }
  box.filled = filled / static_cast<double>(kCells * kCells * kCells);
  return box;
}

// Share of the sides (what does not face along the axis) that turning about it leaves in place.
double Roundness(const UseShape& shape, const Vector3d& axis, const Vector3d& middle) {
  constexpr int kStride = 8;
  const double near = std::max(0.0015, 0.02 * Extent(shape.mesh).norm());
  int sides = 0, kept = 0;
  for (const double degrees : {37.0, 90.0, 151.0, 222.0, 305.0}) {
    const Matrix3d turn = ExpSO3(degrees * kDegree * axis);
    for (Eigen::Index i = 0; i < shape.points.cols(); i += kStride) {
      Vector3d normal;
      shape.object.Distance(shape.points.col(i), &normal);
      if (std::abs(normal.dot(axis)) > 0.9 * normal.norm()) continue;
      ++sides;
      kept +=
          std::abs(shape.object.Distance(middle + turn * (shape.points.col(i) - middle))) < near;
    }
  }
  return sides == 0 ? 0.0 : kept / static_cast<double>(sides);
}

bool IsBall(const UseShape& shape) {
  const Eigen::RowVectorXd far = (shape.points.colwise() - shape.middle).colwise().norm();
  const double mean = far.mean();
  return std::sqrt((far.array() - mean).square().mean()) < 0.13 * mean;
}

// ---- uses

// Nothing above a rim: neither fingers in what is poured, nor a palm on it.
UseZone Above(const Opening& opening, double below_rim) {
  return {opening.middle - opening.middle.dot(opening.up) * opening.up,
          opening.up,
          opening.rim - below_rim,
          opening.rim + 0.2,
          0.0,
          opening.radius + 0.012};
}

std::optional<ObjectUse> AsHandle(const UseShape& shape, const Opening& opening,
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
    // Lies on its side: scissors, clamps. What is opposite the loops points away from the wrist.
    const Vector3d away = shape.middle - bars;
    use.up_weight = 1.0;
    const Vector3d level = away - away.z() * Vector3d::UnitZ();
    if (level.norm() > 0.02) use.thumb = level.normalized();
  } else if (std::abs(handles.front().along.dot(use.up)) > 0.5) {
    use.thumb = use.up;
  }
  return use;
}

std::optional<ObjectUse> AsBox(const UseShape& shape, const BoxShape& box, bool wanted) {
  const bool is_box = box.filled > 0.87 || (box.filled > 0.65 && box.square > 0.75);
  if (!(wanted ? box.filled > 0.5 : is_box) || box.side[2] > 0.095) return std::nullopt;
  if (!wanted && box.side[2] < 0.004) return std::nullopt;  // a sheet
  ObjectUse use;
  use.kind = GraspUse::kBox;
  const bool card = box.side[2] < 0.02 && box.side[1] < 0.095;  // a phone lies in the palm
  const double across = card ? box.side[1] : box.side[2];
  for (int k = card ? 1 : 2; k >= 0; --k) {
    if (box.side[k] < 1.15 * across && box.side[k] < 0.095) use.press.push_back(box.axes.col(k));
  }
  if (card) {
    // Its face is to be seen.
    const Vector3d up = box.axes.col(2).z() < 0.0 ? Vector3d(-box.axes.col(2)) : box.axes.col(2);
    use.ahead = box.axes.col(1);
    use.up = up;
    use.up_weight = 1.0;
    const double top = shape.Along(up).high;
    use.keep_free.push_back({shape.middle - shape.middle.dot(up) * up, up, top + 0.002, top + 0.2,
                             0.0, 0.4 * box.side[1]});
    return use;
  }
  for (int k = 0; k < 3; ++k) {
    const Vector3d axis = box.axes.col(k);
    if (std::abs(axis.z()) < 0.9) continue;
    if (k == 2) break;
    use.up_weight = 3.0;
    // A hand comes from the side, half way up, the thumb above; a wide box it takes near an edge.
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

std::optional<ObjectUse> AsTool(const UseShape& shape, const Opening& opening, bool wanted) {
  const Grip grip = FindGrip(shape);
  if (grip.last - grip.first < 2 || grip.Length() < (wanted ? 0.03 : 0.04)) return std::nullopt;
  const Slices& slices = grip.slices;
  const Vector3d &axis = slices.axis, &line = grip.line;
  const double whole = slices.span.Length(), wide = grip.wide;
  const Span run = grip.Run();
  const std::array<Beyond, 2>& ends = grip.ends;
  int head = ends[1].Bulk() > ends[0].Bulk() ? 1 : 0;
  bool has_head = ends[head].length > 0.25 * grip.Length() || ends[head].reach > 0.8 * wide;
  if (ends[head].Bulk() == 0.0) has_head = false;
  Span held = run;
  if (!has_head) {
    // A bar as a whole: its grip is the end that is thicker and more even.
    if (whole < 2.2 * wide || whole < 0.09 || grip.bend > 0.006) return std::nullopt;
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
    held = head == 1 ? Span{run.low, run.low + 0.6 * run.Length()}
                     : Span{run.high - 0.6 * run.Length(), run.high};
  }
  const double sign = head == 1 ? 1.0 : -1.0;
  ObjectUse use;
  use.kind = GraspUse::kTool;
  const bool pinned = ends[1 - head].Bulk() > 0.0;  // something at the other end, too
  // A hand's breadth near the end, not beyond it.
  const double breadth = std::min(kHandBreadth, held.Length());
  const double from_end = (pinned ? 0.5 : 0.15) * (held.Length() - breadth);
  const double start = head == 1 ? held.low + from_end : held.high - from_end - breadth;
  use.hold = UseZone{line, axis, start - 0.005, start + breadth + 0.005};
  use.held_at = line + (start + 0.5 * breadth) * axis;
  if (!has_head) return use;
  use.thumb = sign * axis;
  const Vector3d& off = ends[head].off;
  // A pistol grip: the head stands out far, and farther to one side. With a battery at the other
  // end a little farther is enough.
  const double reach = ends[head].reach;
  const bool stands_out = reach > std::max(0.045, 1.5 * wide);
  if (opening.Any()) {  // a pan
    use.up = opening.up;
    use.up_weight = 3.0;
  } else if (stands_out && off.norm() > (grip.Waist() ? 0.004 : std::max(0.012, 0.15 * reach))) {
    use.ahead = off.normalized();
    use.up = use.thumb;
    use.up_weight = 2.0;
  }
  return use;
}

// The way up of what stands along `axis`: z if that is it, else its opening or its thinner end.
Vector3d UpAlong(const UseShape& shape, const Vector3d& axis) {
  if (std::abs(axis.z()) > 0.9) return axis.z() > 0.0 ? axis : Vector3d(-axis);
  const bool heavy_above = axis.dot(shape.centroid) > shape.Along(axis).Middle();
  return heavy_above ? Vector3d(-axis) : axis;
}

std::optional<ObjectUse> AsVessel(const UseShape& shape, const Opening& opening, bool wanted) {
  // About which axis: that of the opening, or one that it is round or long about.
  std::vector<Vector3d> axes;
  if (opening.Any()) axes.push_back(opening.up);
  axes.push_back(Vector3d::UnitZ());
  for (int k = 0; k < 3; ++k) axes.push_back(shape.axes.col(k));
  for (const Vector3d& axis : axes) {
    const bool open = opening.Any() && std::abs(axis.dot(opening.up)) > 0.9;
    const Slices slices = Cut(shape, axis, 24);
    std::vector<double> narrow, wide;
    for (const Slice& slice : slices.at) {
      if (slice.count < 4) continue;
      narrow.push_back(slice.narrow);
      wide.push_back(slice.wide);
    }
    if (narrow.empty()) continue;
    const double widest = *std::max_element(wide.begin(), wide.end());
    const bool straight = std::ranges::all_of(slices.at, [&](const Slice& slice) {
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
    use.up = open ? opening.up : UpAlong(shape, axis);
    use.up_weight = 3.0;
    const Span stand = shape.Along(use.up);
    const double top = stand.high;
    // Below what is drunk from or screwed, above the table.
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

std::optional<ObjectUse> AsDish(const UseShape& shape, const Opening& opening, bool wanted) {
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
  const Span stand = shape.Along(use.up);
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
  // The rim: the top of the wall of a bowl, the edge of a plate.
  const double deep = opening.Any() ? std::max(0.5 * (opening.rim - opening.floor), 0.02) : 1.0;
  use.hold = UseZone{line, use.up, stand.high - deep, stand.high + 0.01, least - 0.035};
  if (stand.Length() < 0.045) use.press.push_back(use.up);
  return use;
}

}  // namespace

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

double UseZone::Share(const Vector3d& point, double soft_m) const {
  const Vector3d apart = point - base;
  const double s = apart.dot(axis), r = (apart - s * axis).norm();
  const double outside = std::max({0.0, low - s, s - high, inner - r, r - radius});
  return std::max(0.0, 1.0 - outside / soft_m);
}

double ObjectUse::HoldWeight(const Vector3d& point) const {
  constexpr double kSoft = 0.03;
  double weight = hold ? hold->Share(point, kSoft) : 1.0;
  for (const UseZone& zone : keep_free) weight = std::min(weight, 1.0 - zone.Share(point, 0.005));
  return weight;
}

double ObjectUse::OppositionWeight(const Vector3d& center, const Vector3d& axis) const {
  double along = press.empty() ? 1.0 : 0.0;
  for (const Vector3d& way : press) along = std::max(along, std::abs(way.dot(axis)));
  // A hand around something that stands presses level.
  if (kind == GraspUse::kVessel) along = std::min(along, 1.0 - std::abs(axis.dot(up)));
  return std::exp(-2.0 * (1.0 - HoldWeight(center)) - 1.5 * (1.0 - along));
}

double ObjectUse::DirectionScore(const Vector3d& across, const Vector3d& forward) const {
  double score = 0.0;
  if (!thumb.isZero()) score += 0.6 * (across.dot(thumb) - 1.0);
  if (!ahead.isZero()) {
    // A card is taken from either of its long edges.
    const double along = forward.dot(ahead);
    score += 0.6 * ((kind == GraspUse::kBox ? std::abs(along) : along) - 1.0);
  }
  return score;
}

double ObjectUse::PlaceScore(std::span<const GraspContact> contacts, const Matrix3Xd& skin) const {
  double score = 0.0;
  if (!contacts.empty()) {
    double held = 0.0, along = 0.0;
    for (const GraspContact& contact : contacts) {
      held += HoldWeight(contact.point);
      double most = press.empty() ? 1.0 : 0.0;
      for (const Vector3d& way : press) most = std::max(most, std::abs(way.dot(contact.inward)));
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
  const UseShape shape = ShapeOf(mesh, object);
  const Opening opening = FindOpening(shape);
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

}  // namespace holdfast
