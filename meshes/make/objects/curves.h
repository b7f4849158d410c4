// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "meshes/make/objects/solids.h"

/// The drawn lines that solids are made from: outlines, profiles and sweep paths. Millimetres.
namespace holdfast::solids {

using Outline = std::vector<Vec2>;

/// A vertex of an outline, to be replaced by an arc of radius `round` (0: a sharp corner).
struct Corner {
  double x;
  double y;
  double round = 0.0;
};

/// The polyline through `corners` with its corners rounded, arcs cut into chords of at most
/// `degrees` of turn. The ends of an open path stay sharp. A radius too large for its neighbours is
/// reduced to what fits.
Outline RoundedPath(const std::vector<Corner>& corners, bool closed, double degrees = 6.0);

/// Centripetal Catmull-Rom spline through `points`, `steps` chords between neighbours.
Outline Spline(const std::vector<Vec2>& points, int steps = 16);

/// The open path moved by `distance` to its left (seen along the path, x right, y up).
Outline OffsetLeft(const Outline& path, double distance);

/// The full silhouette of a half profile that starts and ends on the axis x = 0.
Outline Mirrored(Outline half);

/// Signed distance to a closed outline: negative inside. Orientation does not matter.
class Region {
 public:
  explicit Region(Outline outline);
  double operator()(const Vec2& p) const;

 private:
  /// A run of edges and the disc around it, to pass over what is far away.
  struct Stretch {
    std::size_t begin;
    std::size_t end;  ///< edges [begin, end), edge i from vertex i to i + 1
    Vec2 middle;
    double radius;
  };

  Outline outline_;  // the first vertex again at the end
  std::vector<Stretch> stretches_;
};

/// A section of a sweep: where it is centred and its half sizes.
struct Station {
  Vec3 center;
  double half_side;  ///< along the sweep's side axis
  double half_up;    ///< across it, in the plane of bending
};

/// A tube along a smooth path through stations, its elliptic or squarish section changing on the
/// way.
class Sweep {
 public:
  /// Where a point lies in the frame of the nearest section.
  struct Place {
    double along;  ///< 0 at the first station, 1 at the last, by arc length
    double side;   ///< offset along the side axis
    double up;     ///< offset across it
    double past;   ///< how far beyond an end (0 between the ends)
    double half_side;
    double half_up;
  };

  /// `side` is the axis that the path never bends towards; `steps` chords between stations.
  Sweep(const std::vector<Station>& stations, const Vec3& side, int steps = 16);

  Place Locate(const Vec3& p) const;

  /// Distance with a superelliptic section (exponent 2: ellipse, higher: squarer) and ends that
  /// bulge by `cap` (0: cut flat, sharp).
  double Distance(const Vec3& p, double exponent, double cap) const;

 private:
  /// A run of chords and a ball around it, to pass over what is far away.
  struct Stretch {
    std::size_t begin;
    std::size_t end;  ///< chords [begin, end)
    Vec3 middle;
    double radius;
  };

  std::vector<Vec3> centers_;
  std::vector<Vec3> tangents_;
  std::vector<Vec2> halves_;
  std::vector<double> lengths_;
  std::vector<Stretch> stretches_;
  Vec3 side_;
};

}  // namespace holdfast::solids
