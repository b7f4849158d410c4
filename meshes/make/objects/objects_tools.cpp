// SPDX-License-Identifier: MIT
#include <numbers>

#include "meshes/make/objects/curves.h"
#include "meshes/make/objects/implicit_mesher.h"
#include "meshes/make/objects/object_shapes.h"

namespace holdfast {
namespace {

using namespace solids;  // the primitives are this file's vocabulary

/// The point with its axes renamed, so that what is drawn around z lies along x.
Vec3 AlongX(const Vec3& p) { return {p.y(), p.z(), p.x()}; }

/// A 16 oz claw hammer on its side: handle along x, face towards +y, claw towards -y.
TriangleMesh Hammer() {
  constexpr double kHead = 137.0;  // x of the middle of the head
  const Sweep handle({{{-172, 0, 0}, 11.5, 16.5},
                      {{-160, 0, 0}, 12.0, 17.5},
                      {{-135, 0, 0}, 11.2, 15.5},
                      {{-95, 0, 0}, 11.8, 16.8},
                      {{-50, 0, 0}, 11.2, 15.4},
                      {{10, 0, 0}, 9.6, 12.2},
                      {{70, 0, 0}, 8.8, 11.0},
                      {{110, 0, 0}, 8.8, 11.6},
                      {{kHead + 15.5, 0, 0}, 8.8, 11.6}},
                     Vec3::UnitZ());
  const Sweep claw({{{kHead, -4, 0}, 13.0, 12.5},
                    {{kHead, -18, 0}, 12.6, 10.5},
                    {{kHead - 3, -34, 0}, 14.0, 7.4},
                    {{kHead - 11, -50, 0}, 15.5, 4.4},
                    {{kHead - 23, -64, 0}, 16.0, 1.7}},
                   Vec3::UnitZ());
  const Region poll(RoundedPath({{-20, -8},
                                 {12.0, -8},
                                 {12.0, 14, 6},
                                 {10.2, 20, 8},
                                 {10.2, 27, 6},
                                 {14.2, 33, 3},
                                 {14.2, 46, 1.6},
                                 {-20, 46}},
                                true));
  const auto solid = [&](const Vec3& p) {
    const Vec3 in_head = p - Vec3(kHead, 0, 0);
    const double cheek = Box(in_head, {13.5, 15.0, 12.8}, 3.0);
    // The striking face is a shallow dome.
    const double face = RoundedIntersection(poll({std::hypot(in_head.x(), in_head.z()), p.y()}),
                                            Sphere(p - Vec3(kHead, -75, 0), 120.5), 1.2);
    double prongs = claw.Distance(p, 6.0, 0.0);
    const double reach = -24.0 - p.y();  // the nail slot opens from here to the tips
    const double slot = std::abs(p.z()) - (1.5 + 0.10 * std::max(reach, 0.0));
    prongs = Difference(prongs, Intersection(slot, -reach));
    const double head = SmoothUnion(SmoothUnion(cheek, face, 5.0), prongs, 5.0);
    const double wood = RoundedIntersection(handle.Distance(p, 2.3, 0.0), -(p.x() + 172.0), 4.0);
    return Union(head, wood);
  };
  return MeshImplicitSurface(solid, {-173, -75, -18}, {kHead + 17, 48, 18},
                             {.cell = 0.7, .max_edge = 3.6, .min_edge = 1.0, .chord_error = 0.10});
}

/// A chef's knife on its side: blade to +x, edge to -y.
TriangleMesh Knife() {
  // Blade outline in the plane, heel at x = 0.
  Outline blade = Spline({{-14, -2}, {-8, -5}, {-2, -12}, {-1, -22}}, 6);
  for (const Vec2& point :
       Spline({{0.5, -24.5}, {30, -25.5}, {75, -24}, {110, -19}, {135, -11}, {152, -1.5}}, 10)) {
    blade.push_back(point);
  }
  for (const Vec2& point : Spline({{152, 0.5}, {110, 8.5}, {60, 13}, {10, 15}, {-14, 15}}, 8)) {
    blade.push_back(point);
  }
  const Region blade_side(std::move(blade));
  const Sweep handle({{{-128, -6, 0}, 9.5, 13.5},
                      {{-118, -4, 0}, 10.2, 14.0},
                      {{-100, 1, 0}, 9.4, 11.5},
                      {{-70, 4.5, 0}, 10.2, 12.2},
                      {{-40, 5, 0}, 9.4, 11.0},
                      {{-16, 5.5, 0}, 8.6, 10.4},
                      {{-8, 5.5, 0}, 7.0, 9.4}},
                     Vec3::UnitZ());
  const auto solid = [&](const Vec3& p) {
    // Ground flat from the spine (2.6 mm) down to the edge (0.7 mm).
    const double half = 0.35 + 0.95 * std::clamp((p.y() + 25.0) / 34.0, 0.0, 1.0);
    const double steel = Intersection(blade_side({p.x(), p.y()}), std::abs(p.z()) - half);
    const double scales = RoundedIntersection(handle.Distance(p, 3.0, 0.0), -p.x() - 129.0, 3.0);
    double grip = Union(scales, steel);
    for (const double x : {-105.0, -67.0, -29.0}) {
      const double y = x < -100.0 ? 0.0 : 4.5;
      const double rivet = std::hypot(p.x() - x, p.y() - y) - 3.8;
      grip = Union(grip, Intersection(rivet, handle.Distance(p, 3.0, 0.0) - 0.35));
    }
    return grip;
  };
  return MeshImplicitSurface(solid, {-130, -27, -11}, {154, 21, 11},
                             {.cell = 0.4, .max_edge = 2.6, .min_edge = 1.0, .chord_error = 0.08});
}

TriangleMesh FryingPan() {
  const Region shell(RoundedPath(
      {{-20, 0}, {80, 0, 8}, {100.5, 42, 1.6}, {97, 42, 1.6}, {77.5, 3.4, 7}, {-20, 3.4}}, true));
  const Sweep handle({{{92, 0, 33}, 15, 4.5},
                      {{108, 0, 39}, 10, 5},
                      {{135, 0, 48}, 9.2, 6},
                      {{180, 0, 56}, 12, 8},
                      {{225, 0, 58}, 13, 8.5},
                      {{262, 0, 56}, 12, 7.5},
                      {{276, 0, 54.5}, 10, 6.5}},
                     Vec3::UnitY());
  const Region inside(RoundedPath({{-20, 3.4}, {77.5, 3.4, 7}, {107, 62}, {-20, 62}}, true));
  const auto solid = [&](const Vec3& p) {
    const Vec2 turned(std::hypot(p.x(), p.y()), p.z());
    double grip = handle.Distance(p, 2.6, 5.0);
    const double eye =
        Extrusion(Capsule({p.x(), p.y(), 0}, {262, 0, 0}, {270, 0, 0}, 4, 4), p.z() - 56, 20);
    grip = RoundedIntersection(grip, -eye, 1.5);
    grip = std::max(grip, -inside(turned));
    return SmoothUnion(shell(turned), grip, 0.8);
  };
  return MeshImplicitSurface(solid, {-101, -101, 0}, {284, 101, 68},
                             {.cell = 0.9, .max_edge = 6.2, .min_edge = 1.1, .chord_error = 0.24});
}

/// Lies on its back, bristles up, head to +x.
TriangleMesh Toothbrush() {
  const Sweep handle({{{-96, 0, 1.0}, 4.6, 3.2},
                      {{-88, 0, 0.6}, 5.8, 4.2},
                      {{-70, 0, 0}, 6.6, 5.2},
                      {{-45, 0, 0.6}, 6.4, 5.6},
                      {{-22, 0, 3.0}, 6.0, 5.4},
                      {{-6, 0, 4.6}, 7.0, 6.0},
                      {{12, 0, 3.8}, 5.6, 5.0},
                      {{30, 0, 1.6}, 3.4, 3.6},
                      {{48, 0, 0.8}, 2.7, 2.8},
                      {{64, 0, 0.8}, 3.6, 2.4}},
                     Vec3::UnitY());
  const auto solid = [&](const Vec3& p) {
    const Vec3 in_head = p - Vec3(78.5, 0, 0.8);
    const double plate =
        Extrusion(Rectangle({in_head.x(), in_head.y()}, {16.5, 6.3}, 5.8), in_head.z(), 2.4, 1.4);
    double brush = SmoothUnion(handle.Distance(p, 2.3, 4.0), plate, 5.0);
    // A thumb rest with three grooves where the grip is widest.
    for (const double x : {-8.0, -3.0, 2.0}) {
      brush = SmoothDifference(brush, Torus(AlongX(p - Vec3(x, 0, 13.3)), 4.2, 1.2), 1.0);
    }
    // Bristles: a wavy block cut into tufts, ten across three.
    const double top = 13.0 + 1.0 * std::cos((p.x() - 78.5) * 0.42);
    const double block = Intersection(Rectangle({in_head.x(), in_head.y()}, {14.0, 5.0}, 4.4),
                                      std::max(p.z() - top, 1.5 - p.z()));
    constexpr double kPitch = 2.8;
    const double to_gap_x = std::abs(std::remainder(in_head.x(), kPitch));
    const double to_gap_y = std::abs(std::abs(in_head.y()) - 1.65);
    const double gaps = std::max(std::min(to_gap_x, to_gap_y) - 0.35, 5.6 - p.z());
    const double tufts = std::max(block, -gaps);
    return Union(brush, tufts);
  };
  return MeshImplicitSurface(solid, {-101, -7, -6}, {96, 7, 15},
                             {.cell = 0.3, .max_edge = 1.7, .min_edge = 0.65, .chord_error = 0.05});
}

/// Lies along x, lens to +x, with a rubber button on top.
TriangleMesh Flashlight() {
  const Region turned_part(RoundedPath({{-20, -78},
                                        {12.3, -78},
                                        {13.4, -76.5},
                                        {13.4, -60},
                                        {12.4, -59},
                                        {12.4, 22, 6},
                                        {18.5, 42, 6},
                                        {18.5, 70},
                                        {19.3, 70},
                                        {19.3, 77.2},
                                        {16.6, 77.2},
                                        {15.8, 73.6},
                                        {-20, 73.6}},
                                       true));
  const auto solid = [&](const Vec3& p) {
    const double radius = std::hypot(p.y(), p.z());
    double body = turned_part({radius, p.x()});
    // Rings around the grip.
    for (int k = 0; k < 8; ++k) {
      const double ring = std::hypot(radius - 12.9, p.x() + 50.0 - 5.0 * k) - 1.15;
      body = SmoothDifference(body, ring, 0.5);
    }
    // Twelve cooling scallops milled into the head.
    const double sector = 2.0 * std::numbers::pi / 12.0;
    const double angle = std::remainder(std::atan2(p.y(), p.z()), sector);
    const double from_cutter =
        std::hypot(radius * std::cos(angle) - 20.3, radius * std::sin(angle));
    const double scallop = std::max(from_cutter - 3.2, std::abs(p.x() - 58.0) - 7.5);
    body = SmoothDifference(body, scallop, 0.8);
    const Vec3 at_button = p - Vec3(8.0, 0, 12.0);
    const double collar = Cylinder(at_button, 7.2, 1.8);
    const double button = RoundedIntersection(std::hypot(at_button.x(), at_button.y()) - 5.0,
                                              Sphere(at_button + Vec3(0, 0, 10.0), 13.2), 0.8);
    return Union(SmoothUnion(body, collar, 1.5), std::max(button, -at_button.z() - 2.0));
  };
  return MeshImplicitSurface(solid, {-79, -20, -20}, {78, 20, 20},
                             {.cell = 0.5, .max_edge = 2.6, .min_edge = 1.0, .chord_error = 0.10});
}

}  // namespace

std::vector<HandheldObject> ToolObjects() {
  return {{"hammer", Hammer},
          {"knife", Knife},
          {"fryingpan", FryingPan},
          {"toothbrush", Toothbrush},
          {"flashlight", Flashlight}};
}

}  // namespace holdfast
