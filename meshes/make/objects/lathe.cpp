// SPDX-License-Identifier: MIT
#include "meshes/make/objects/lathe.h"

#include <array>
#include <numbers>
#include <vector>

#include "geometry/error.h"

namespace holdfast {
namespace {

using solids::Outline;
using solids::Vec2;

double Turn(const Vec2& before, const Vec2& at, const Vec2& after) {
  const Vec2 u = (at - before).normalized();
  const Vec2 v = (after - at).normalized();
  return std::acos(std::clamp(u.dot(v), -1.0, 1.0));
}

/// Longest chord of a circle of this radius that stays within the allowed error.
double ChordFor(double radius, const LatheOptions& options) {
  return std::min(options.max_edge, std::sqrt(8.0 * options.chord_error * radius));
}

/// One smooth piece of the profile, sampled more densely where it bends.
void AppendPiece(const Outline& piece, const LatheOptions& options, Outline& samples) {
  const std::size_t n = piece.size();
  std::vector<double> density(n, 1.0 / options.max_edge);
  for (std::size_t i = 1; i + 1 < n; ++i) {
    const double span = 0.5 * (piece[i + 1] - piece[i - 1]).norm();
    const double bend = Turn(piece[i - 1], piece[i], piece[i + 1]) / std::max(span, 1e-9);
    if (bend > 1e-9) density[i] = 1.0 / ChordFor(1.0 / bend, options);
  }
  std::vector<double> measure(n, 0.0);
  for (std::size_t i = 1; i < n; ++i) {
    measure[i] =
        measure[i - 1] + 0.5 * (density[i] + density[i - 1]) * (piece[i] - piece[i - 1]).norm();
  }
  const int count = std::max(1, static_cast<int>(std::ceil(measure.back() - 0.2)));
  std::size_t at = 0;
  for (int k = 1; k <= count; ++k) {
    const double goal = measure.back() * k / count;
    while (at + 2 < n && measure[at + 1] < goal) ++at;
    const double t =
        std::clamp((goal - measure[at]) / std::max(measure[at + 1] - measure[at], 1e-12), 0.0, 1.0);
    samples.push_back(piece[at] + t * (piece[at + 1] - piece[at]));
  }
}

Outline Resample(const Outline& profile, const LatheOptions& options) {
  const double sharp = options.sharp_degrees * std::numbers::pi / 180.0;
  Outline samples{profile.front()};
  Outline piece{profile.front()};
  for (std::size_t i = 1; i < profile.size(); ++i) {
    piece.push_back(profile[i]);
    const bool last = i + 1 == profile.size();
    if (!last && Turn(profile[i - 1], profile[i], profile[i + 1]) < sharp) continue;
    AppendPiece(piece, options, samples);
    piece = {profile[i]};
  }
  return samples;
}

/// Corners on a ring: from a short ladder of counts, so that neighbouring rings mostly agree and
/// meet in clean triangles.
int RingCount(double radius, const LatheOptions& options) {
  const double wanted = 2.0 * std::numbers::pi * radius / ChordFor(radius, options);
  int base = 8;
  while (true) {
    for (const int count : {base, base * 5 / 4, base * 3 / 2, base * 7 / 4}) {
      if (count >= wanted) return count;
    }
    base *= 2;
  }
}

struct Ring {
  int first = 0;
  int count = 0;
  double phase = 0.0;
};

void Stitch(const Ring& low, const Ring& high, std::vector<std::array<int, 3>>& faces) {
  const auto angle = [](const Ring& ring, int k) {
    return (k + ring.phase) / static_cast<double>(ring.count);
  };
  int i = 0;
  int j = 0;
  const int low_steps = low.count > 1 ? low.count : 0;
  const int high_steps = high.count > 1 ? high.count : 0;
  while (i < low_steps || j < high_steps) {
    // Advance on the ring whose next corner comes first: the shorter diagonal.
    const bool advance_low =
        j >= high_steps ||
        (i < low_steps && angle(low, i + 1) + angle(low, i) <= angle(high, j + 1) + angle(high, j));
    const int a = low.first + i % low.count;
    const int b = high.first + j % high.count;
    if (advance_low) {
      faces.push_back({a, low.first + (i + 1) % low.count, b});
      ++i;
    } else {
      faces.push_back({a, high.first + (j + 1) % high.count, b});
      ++j;
    }
  }
}

}  // namespace

TriangleMesh Lathe(const Outline& profile, const LatheOptions& options) {
  constexpr double kOnAxis = 1e-9;
  if (profile.size() < 3 || profile.front().x() > kOnAxis || profile.back().x() > kOnAxis) {
    throw Error("lathe profile", "it does not start and end on the axis",
                "Close it with points of radius 0.");
  }
  const Outline samples = Resample(profile, options);
  std::vector<solids::Vec3> points;
  std::vector<std::array<int, 3>> faces;
  Ring previous;
  for (std::size_t s = 0; s < samples.size(); ++s) {
    const double radius = samples[s].x();
    Ring ring{static_cast<int>(points.size()), radius <= kOnAxis ? 1 : RingCount(radius, options),
              s % 2 == 0 ? 0.0 : 0.5};
    for (int k = 0; k < ring.count; ++k) {
      const double angle = 2.0 * std::numbers::pi * (k + ring.phase) / ring.count;
      points.emplace_back(radius * std::cos(angle), radius * std::sin(angle), samples[s].y());
    }
    if (s > 0) Stitch(previous, ring, faces);
    previous = ring;
  }
  TriangleMesh mesh;
  mesh.vertices.resize(3, points.size());
  for (std::size_t i = 0; i < points.size(); ++i) mesh.vertices.col(i) = points[i];
  mesh.faces.resize(3, faces.size());
  for (std::size_t f = 0; f < faces.size(); ++f) {
    for (int k = 0; k < 3; ++k) mesh.faces(k, f) = faces[f][k];
  }
  return mesh;
}

}  // namespace holdfast
