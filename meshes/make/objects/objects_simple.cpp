// SPDX-License-Identifier: MIT
#include <numbers>

#include "meshes/make/objects/curves.h"
#include "meshes/make/objects/implicit_mesher.h"
#include "meshes/make/objects/lathe.h"
#include "meshes/make/objects/object_shapes.h"

namespace holdfast {
namespace {

using namespace solids;  // the primitives are this file's vocabulary

TriangleMesh Cube() {
  const auto solid = [](const Vec3& p) { return Box(p, Vec3::Constant(30.0), 2.5); };
  return MeshImplicitSurface(solid, Vec3::Constant(-30.0), Vec3::Constant(30.0),
                             {.cell = 0.8, .max_edge = 3.0, .min_edge = 1.1, .chord_error = 0.09});
}

TriangleMesh RoundBar() {
  return Lathe(RoundedPath({{0, 0}, {25, 0}, {25, 120}, {0, 120}}, false),
               {.max_edge = 2.6, .chord_error = 0.05});
}

/// A tennis ball's size.
TriangleMesh Ball() {
  const auto solid = [](const Vec3& p) { return Sphere(p, 33.5); };
  return MeshImplicitSurface(solid, Vec3::Constant(-33.5), Vec3::Constant(33.5),
                             {.cell = 0.8, .max_edge = 1.9, .min_edge = 1.2, .chord_error = 0.05});
}

TriangleMesh Apple() {
  const Region flesh(Mirrored(Spline({{0, 9.5},
                                      {5, 7.6},
                                      {10, 4},
                                      {16, 1.2},
                                      {23, 2.6},
                                      {31, 12},
                                      {37.5, 28},
                                      {39.6, 43},
                                      {37, 57},
                                      {29.5, 67},
                                      {20, 70.6},
                                      {12, 68.6},
                                      {6, 62.5},
                                      {2, 57.5},
                                      {0, 56.5}},
                                     8)));
  const Sweep stem({{{0, 0, 53}, 1.7, 1.7},
                    {{0.6, 0, 62}, 1.5, 1.5},
                    {{3, 0, 71}, 1.5, 1.5},
                    {{7, 0, 79}, 2.3, 2.1}},
                   Vec3::UnitY());
  const auto solid = [&](const Vec3& p) {
    // Five faint lobes, strongest at the bottom where the crown was; and no apple is upright.
    const double angle = std::atan2(p.y(), p.x());
    const double lobes = 0.030 * (1.0 - 0.75 * SmoothStep(0.0, 60.0, p.z()));
    const double swell = 1.0 + lobes * std::cos(5.0 * angle) + 0.012 * std::cos(angle - 0.7);
    const double lean = 1.0 + 0.00045 * p.x();
    const double body = flesh({std::hypot(p.x(), p.y()) / swell, 35.0 + (p.z() - 35.0) / lean});
    return SmoothUnion(body, stem.Distance(p, 2.0, 0.8), 2.0);
  };
  return MeshImplicitSurface(solid, {-43, -43, 0}, {43, 43, 82},
                             {.cell = 0.7, .max_edge = 2.3, .min_edge = 0.8, .chord_error = 0.06});
}

/// Lies on its side; the stem points to -x.
TriangleMesh Banana() {
  constexpr double kBend = 112.0;  // radius of the middle line
  constexpr double kHalfAngle = 0.86;
  const std::vector<std::pair<double, double>> thickness{
      {0.0, 5.6},  {0.05, 4.9},  {0.11, 5.3},  {0.17, 8.0},  {0.25, 13.0}, {0.36, 16.6},
      {0.5, 18.0}, {0.64, 17.6}, {0.78, 14.8}, {0.88, 10.4}, {0.945, 6.0}, {1.0, 4.2}};
  std::vector<Station> stations;
  for (const auto& [along, radius] : thickness) {
    const double angle = kHalfAngle * (2.0 * along - 1.0);
    // The stem carries on straighter than the fruit bends.
    const double straight = 14.0 * SmoothStep(0.22, -0.05, along);
    stations.push_back({{kBend * std::sin(angle) - 0.3 * straight,
                         kBend * (1.0 - std::cos(angle)) - straight, 0.0},
                        radius,
                        radius});
  }
  const Sweep fruit(stations, Vec3::UnitZ());
  const auto solid = [&](const Vec3& p) {
    const auto place = fruit.Locate(p);
    const double angle = std::atan2(place.up, place.side);
    const double rho = std::hypot(place.side, place.up, 1.4 * place.past);
    // Five flat sides with soft ridges.
    const double ridge = std::cos(5.0 * angle + 0.5 * std::numbers::pi);
    return rho - place.half_side * (1.0 + 0.055 * ridge + 0.016 * ridge * ridge);
  };
  // The ends are cut: the stem where it was broken off, the tip where the flower sat.
  const auto cut = [&](const Vec3& p) {
    const auto place = fruit.Locate(p);
    return RoundedIntersection(solid(p), place.past - 1.0, 1.2);
  };
  return MeshImplicitSurface(cut, {-100, -40, -22}, {95, 70, 22},
                             {.cell = 0.8, .max_edge = 2.5, .min_edge = 0.9, .chord_error = 0.07});
}

}  // namespace

std::vector<HandheldObject> SimpleObjects() {
  return {{"cube", Cube},
          {"cylinder", RoundBar},
          {"sphere", Ball},
          {"apple", Apple},
          {"banana", Banana}};
}

}  // namespace holdfast
