// SPDX-License-Identifier: MIT
#include <numbers>

#include "meshes/make/objects/curves.h"
#include "meshes/make/objects/implicit_mesher.h"
#include "meshes/make/objects/object_shapes.h"

namespace holdfast {
namespace {

using namespace solids;  // the primitives are this file's vocabulary

/// A mirrorless camera as it stands: lens towards -y, the photographer's right hand at -x.
TriangleMesh CameraBody() {
  constexpr double kAxisX = 8.0;  // the lens sits off the middle, away from the grip
  constexpr double kAxisZ = 36.0;
  const Region barrel(RoundedPath({{-40, -10},
                                   {31, -10},
                                   {31, 4},
                                   {29.5, 4},
                                   {29.5, 9},
                                   {32, 9},
                                   {32, 30},
                                   {30.3, 30},
                                   {30.3, 34},
                                   {32, 34},
                                   {32, 49},
                                   {27.5, 49},
                                   {22, 42.5},
                                   {-40, 42.5}},
                                  true));
  const auto solid = [&](const Vec3& p) {
    // Body: seen from above a rounded slab, pulled up.
    const Vec3 c = p - Vec3(0, 0, 35.5);
    double body = Extrusion(Rectangle({c.x(), c.y()}, {64, 17.5}, 9.0), c.z() + 10.0, 45.5, 2.5);
    // Grip for the right hand.
    const double grip = Extrusion(Rectangle({p.x() + 49.0, p.y() + 19.0}, {13.5, 14.0}, 9.5),
                                  p.z() - 21.0, 41.0, 5.0);
    body = RoundedIntersection(SmoothUnion(body, grip, 9.0), -p.z(), 1.8);
    // Viewfinder hump: a roof over the lens axis.
    const Vec3 h = p - Vec3(kAxisX, -1.0, 70.0);
    const double slopes = 0.866 * std::abs(h.x()) + 0.5 * h.z() - 21.5;
    double hump = RoundedIntersection(slopes, h.z() - 18.0, 4.0);
    hump = RoundedIntersection(hump, std::abs(h.y()) - 17.0 + 0.12 * std::max(h.z(), 0.0), 4.0);
    hump = std::max(hump, -h.z() - 12.0);
    body = SmoothUnion(body, hump, 5.0);
    // Eyepiece with a cup, at the back of the hump.
    const Vec3 e = p - Vec3(kAxisX, 18.0, 77.0);
    const double cup = Extrusion(Rectangle({e.x(), e.z()}, {14.5, 9.5}, 6.0), e.y(), 5.0, 1.6);
    const double glass =
        Extrusion(Rectangle({e.x(), e.z()}, {9.5, 5.8}, 3.0), e.y() - 5.0, 2.2, 0.0);
    body = Union(body, cup);
    body = Difference(body, glass);
    // Hot shoe.
    const Vec3 shoe = p - Vec3(kAxisX, 1.0, 89.0);
    body = Union(body, Box(shoe, {9.5, 9.0, 1.6}));
    body = Difference(body, Box(shoe - Vec3(0, 1.0, 1.4), {6.4, 9.0, 1.1}));
    // Lens: barrel with two rings, front glass a shallow dome in its well.
    const Vec3 l(p.x() - kAxisX, p.z() - kAxisZ, -17.0 - p.y());
    const double radius = std::hypot(l.x(), l.y());
    double lens = barrel({radius, l.z()});
    const double angle = std::atan2(l.y(), l.x());
    // Grip ribs of the zoom ring.
    const double rib = std::abs(std::remainder(angle, std::numbers::pi / 20.0)) * 32.0;
    const double groove = std::max({rib - 1.2, 31.1 - radius, std::abs(l.z() - 19.5) - 8.0});
    lens = Difference(lens, groove);
    const double dome = std::max(Sphere(l - Vec3(0, 0, -2.0), 48.0), radius - 21.5);
    lens = Union(lens, std::max(dome, 20.0 - l.z()));
    body = SmoothUnion(body, lens, 1.5);
    // Shutter button on the grip, mode dial, rear wheel, a row at the back.
    const double collar = Cylinder(p - Vec3(-51, -20, 62), 8.5, 3.0);
    body = SmoothUnion(body, collar, 2.0);
    body = Union(body, Cylinder(p - Vec3(-51, -20, 64), 5.5, 3.4));
    const Vec3 d = p - Vec3(-38, 3, 74);
    body = Union(body, Cylinder(d, 10.0, 5.5));
    body = Union(body, Cylinder(d, 8.2, 6.5));
    body = Union(body, Cylinder(p - Vec3(47, 1, 71), 9.0, 3.0));
    // Screen at the back, framed.
    const Vec3 s = p - Vec3(8.0, 17.5, 33.0);
    body = Union(body, Extrusion(Rectangle({s.x(), s.z()}, {41, 28}, 3.0), s.y(), 2.6));
    body =
        Difference(body, Extrusion(Rectangle({s.x(), s.z()}, {37, 24.5}, 1.5), s.y() - 2.6, 0.8));
    // Thumb rest, four-way pad and its centre.
    body = SmoothUnion(body, Ellipsoid(p - Vec3(-52, 17.0, 56), {9, 5.5, 12}), 4.0);
    const Vec3 pad = p - Vec3(-48, 17.5, 27);
    const double pad_radius = std::hypot(pad.x(), pad.z());
    body = Union(body, Extrusion(pad_radius - 9.5, pad.y(), 1.8));
    body = Union(body, Extrusion(pad_radius - 4.0, pad.y(), 2.8));
    return body;
  };
  return MeshImplicitSurface(solid, {-68, -68, 0}, {68, 26, 93},
                             {.cell = 0.55, .max_edge = 3.8, .min_edge = 1.4, .chord_error = 0.14});
}

/// Lies on its screen: the lenses look up.
TriangleMesh Phone() {
  const auto solid = [](const Vec3& p) {
    const Vec3 c = p - Vec3(0, 0, 3.9);
    double body = Extrusion(Rectangle({c.x(), c.y()}, {35.7, 73.5}, 11.0), c.z(), 3.9, 1.8);
    // Lens island in the corner, three lenses and a flash.
    const Vec3 i = p - Vec3(-15.5, 53.5, 7.8);
    body = Union(body, Extrusion(Rectangle({i.x(), i.y()}, {16.0, 16.0}, 7.0), i.z(), 1.6));
    for (const Vec2& lens : {Vec2(-7.4, 7.4), Vec2(-7.4, -7.4), Vec2(6.6, 0.0)}) {
      const Vec3 l = i - Vec3(lens.x(), lens.y(), 1.6);
      body = Union(body, Cylinder(l, 5.9, 1.5));
      body = Difference(body, Cylinder(l - Vec3(0, 0, 1.5), 4.4, 0.6));
    }
    body = Difference(body, Cylinder(i - Vec3(8.6, 10.2, 1.6), 2.2, 0.5));
    // Power on one side, volume on the other.
    body = Union(body, Box(c - Vec3(35.7, 22, 0), {0.7, 8.5, 1.4}));
    body = Union(body, Box(c - Vec3(-35.7, 27, 0), {0.7, 5.5, 1.4}));
    body = Union(body, Box(c - Vec3(-35.7, 12, 0), {0.7, 5.5, 1.4}));
    // Charging port.
    body =
        Difference(body, Extrusion(Rectangle({c.x(), c.z()}, {4.5, 1.4}, 1.4), c.y() + 73.5, 4.0));
    return body;
  };
  return MeshImplicitSurface(solid, {-37, -74, 0}, {37, 74, 11},
                             {.cell = 0.4, .max_edge = 2.9, .min_edge = 0.9, .chord_error = 0.09});
}

/// An E27 bulb standing on its contact.
TriangleMesh LightBulb() {
  Outline half = Spline({{13.6, 29},
                         {13.9, 34},
                         {16.4, 43},
                         {21.6, 54},
                         {27.2, 65},
                         {29.8, 76},
                         {28.9, 87},
                         {24.6, 97},
                         {17.0, 104.5},
                         {8.5, 108.3},
                         {0, 109.4}},
                        8);
  half.insert(half.begin(), Vec2(0, 20));
  half.insert(half.begin() + 1, Vec2(13.6, 20));
  const Region glass(Mirrored(half));
  const Region cap(RoundedPath({{-20, 0},
                                {4.8, 0, 1.0},
                                {5.4, 2.2, 0.8},
                                {10.8, 5.6, 1.0},
                                {12.2, 8.2, 0.8},
                                {12.2, 29, 0.8},
                                {-20, 29}},
                               true));
  const auto solid = [&](const Vec3& p) {
    const double radius = std::hypot(p.x(), p.y());
    // The thread: a helix of 3.6 mm pitch on the cap.
    const double turn = std::atan2(p.y(), p.x()) / (2.0 * std::numbers::pi);
    const double wave = std::cos(2.0 * std::numbers::pi * (p.z() / 3.6 - turn));
    const double thread_zone = SmoothStep(8.5, 10.5, p.z()) * (1.0 - SmoothStep(25.5, 27.5, p.z()));
    const double screw = cap({radius - 0.75 * thread_zone * wave, p.z()});
    return Union(screw, glass({radius, p.z()}));
  };
  return MeshImplicitSurface(solid, {-31, -31, 0}, {31, 31, 110},
                             {.cell = 0.5, .max_edge = 2.4, .min_edge = 0.9, .chord_error = 0.06});
}

}  // namespace

std::vector<HandheldObject> DeviceObjects() {
  return {{"camera", CameraBody}, {"phone", Phone}, {"lightbulb", LightBulb}};
}

}  // namespace holdfast
