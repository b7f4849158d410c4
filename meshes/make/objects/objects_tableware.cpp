// SPDX-License-Identifier: MIT
#include <numbers>

#include "meshes/make/objects/curves.h"
#include "meshes/make/objects/implicit_mesher.h"
#include "meshes/make/objects/lathe.h"
#include "meshes/make/objects/object_shapes.h"

namespace holdfast {
namespace {

using namespace solids;  // the primitives are this file's vocabulary

constexpr double kPastAxis = -20.0;  // regions run past the axis: no boundary lies on it

double Radius(const Vec3& p) { return std::hypot(p.x(), p.y()); }

void Append(Outline& path, const Outline& more) {
  path.insert(path.end(), more.begin(), more.end());
}

/// The rounded rim between the outer and the inner wall: half a circle from a to b, over the top.
Outline Rim(const Vec2& a, const Vec2& b, int chords = 8) {
  const Vec2 center = 0.5 * (a + b);
  const Vec2 out = a - center;
  const Vec2 up(-out.y(), out.x());
  Outline arc;
  for (int k = 1; k < chords; ++k) {
    const double angle = std::numbers::pi * k / chords;
    arc.push_back(center + std::cos(angle) * out + std::sin(angle) * up);
  }
  return arc;
}

TriangleMesh Mug() {
  const Region outside(RoundedPath({{kPastAxis, 2.2},
                                    {29, 2.2, 1.2},
                                    {30.5, 0, 1.2},
                                    {36, 0, 2.5},
                                    {41, 7, 7},
                                    {41, 96},
                                    {kPastAxis, 96}},
                                   true));
  const Region inside(
      RoundedPath({{kPastAxis, 7}, {37.2, 7, 9}, {37.2, 130}, {kPastAxis, 130}}, true));
  const Sweep handle({{{36, 0, 79}, 7.5, 5.0},
                      {{48, 0, 82.5}, 6.8, 4.2},
                      {{62, 0, 81}, 6.3, 3.9},
                      {{72, 0, 70}, 6.2, 3.9},
                      {{73.5, 0, 55}, 6.2, 3.9},
                      {{68, 0, 39}, 6.2, 3.9},
                      {{56, 0, 27}, 6.4, 4.0},
                      {{46, 0, 21.5}, 6.8, 4.2},
                      {{36, 0, 18.5}, 7.5, 5.0}},
                     Vec3::UnitY());
  const auto solid = [&](const Vec3& p) {
    const Vec2 turned(Radius(p), p.z());
    const double full = SmoothUnion(outside(turned), handle.Distance(p, 2.6, 3.0), 4.0);
    return RoundedIntersection(full, -inside(turned), 1.85);
  };
  return MeshImplicitSurface(solid, {-41, -41, 0}, {80, 41, 96},
                             {.cell = 0.7, .max_edge = 3.6, .min_edge = 1.5, .chord_error = 0.12});
}

TriangleMesh Teapot() {
  const Region body(RoundedPath({{kPastAxis, 2},
                                 {33, 2, 1.2},
                                 {35, 0, 1.2},
                                 {40, 0, 2},
                                 {42, 5, 4},
                                 {70, 30, 34},
                                 {69, 78, 42},
                                 {39, 101, 10},
                                 {39, 104, 1.2},
                                 {kPastAxis, 104}},
                                true));
  const Region lid(RoundedPath({{kPastAxis, 90},
                                {36.5, 90},
                                {36.5, 106, 2},
                                {26, 113, 40},
                                {9, 117, 6},
                                {5.5, 121, 5},
                                {6.5, 125, 3},
                                {11.5, 128, 4},
                                {11.5, 135, 5},
                                {4, 139, 12},
                                {kPastAxis, 139}},
                               true));
  const Sweep spout({{{48, 0, 36}, 15, 17},
                     {{66, 0, 46}, 12.5, 14},
                     {{80, 0, 62}, 10, 11},
                     {{90, 0, 82}, 8.5, 9},
                     {{102, 0, 98}, 8, 8.5},
                     {{112, 0, 106}, 8, 8.5}},
                    Vec3::UnitY());
  const Sweep bore({{{92, 0, 86}, 4, 4}, {{103, 0, 99}, 5.6, 6}, {{114, 0, 107.5}, 6.2, 6.6}},
                   Vec3::UnitY());
  const Sweep handle({{{-54, 0, 84}, 7.5, 5.5},
                      {{-74, 0, 93}, 6.5, 4.8},
                      {{-93, 0, 90}, 6.5, 4.8},
                      {{-104, 0, 74}, 6.5, 4.8},
                      {{-101, 0, 54}, 6.5, 4.8},
                      {{-88, 0, 37}, 6.5, 4.8},
                      {{-70, 0, 27}, 6.8, 5.0},
                      {{-52, 0, 24}, 7.5, 5.5}},
                     Vec3::UnitY());
  const auto solid = [&](const Vec3& p) {
    const Vec2 turned(Radius(p), p.z());
    double pot = SmoothUnion(body(turned), handle.Distance(p, 2.5, 3.0), 6.0);
    const double pipe = Difference(spout.Distance(p, 2.0, 0.0), bore.Distance(p, 2.0, 0.0));
    pot = SmoothUnion(pot, pipe, 8.0);
    return Union(pot, lid(turned));
  };
  return MeshImplicitSurface(solid, {-112, -72, 0}, {120, 72, 140},
                             {.cell = 0.8, .max_edge = 4.8, .min_edge = 1.1, .chord_error = 0.16});
}

TriangleMesh Bottle() {
  const Outline profile = RoundedPath(
      {{0, 5},           {10, 4.5, 8},     {20, 0, 3},         {28, 0, 4},         {32.5, 6, 6},
       {32.5, 22, 1},    {31.2, 24, 1},    {31.2, 26, 1},      {32.5, 28, 1},      {32.5, 36, 1},
       {31.2, 38, 1},    {31.2, 40, 1},    {32.5, 42, 1},      {32.5, 54, 18},     {29, 68, 22},
       {29, 78, 22},     {32.5, 92, 18},   {32.5, 132, 34},    {26, 158, 40},      {13.2, 182, 14},
       {13.2, 189, 1},   {16.6, 190, 0.6}, {16.6, 192, 0.6},   {13.2, 193},        {13.2, 194},
       {15.2, 194, 0.5}, {15.2, 197, 0.4}, {14.6, 197.4, 0.4}, {14.6, 211.5, 1.8}, {0, 211.5}},
      false);
  return Lathe(profile, {.max_edge = 3.2, .chord_error = 0.05});
}

TriangleMesh Bowl() {
  const Outline shell =
      Spline({{0, 6}, {12, 6.2}, {26, 8.5}, {42, 17}, {57, 33}, {68, 52}, {74.5, 72}}, 12);
  Outline profile =
      RoundedPath({{0, 4.5}, {30, 5.2, 1.5}, {31.5, 0, 1.2}, {35.5, 0, 1.2}, {38, 13}}, false);
  for (const Vec2& point : shell) {
    if (point.x() > 40.0) profile.push_back(point);
  }
  const Outline inner = OffsetLeft(shell, 3.8);
  Append(profile, Rim(shell.back(), inner.back()));
  Append(profile, {inner.rbegin(), inner.rend()});
  profile.back().x() = 0.0;
  return Lathe(profile, {.max_edge = 3.6, .chord_error = 0.07});
}

TriangleMesh WineGlass() {
  Outline profile = RoundedPath(
      {{0, 1.2}, {20, 0.9}, {31, 0, 3}, {36, 0.2, 0.7}, {36, 1.9, 0.7}, {33, 2.3}}, false);
  // The wall is the gap between two splines through corresponding points.
  const Outline outer = Spline({{32.9, 2.3},
                                {24, 3.6},
                                {14, 6.2},
                                {7.4, 12},
                                {4.6, 24},
                                {3.8, 42},
                                {3.8, 66},
                                {4.6, 82},
                                {8.5, 92},
                                {19, 101.5},
                                {31, 115},
                                {38.8, 135},
                                {40.4, 156},
                                {38, 182},
                                {33, 213}},
                               10);
  const Outline inner = Spline({{31.4, 213},
                                {36.4, 182},
                                {38.8, 156},
                                {37.2, 135.4},
                                {29.7, 116.1},
                                {18, 103.3},
                                {8.5, 97.6},
                                {0, 96}},
                               10);
  Append(profile, outer);
  Append(profile, Rim(outer.back(), inner.front(), 6));
  Append(profile, inner);
  return Lathe(profile, {.max_edge = 3.3, .chord_error = 0.09});
}

}  // namespace

std::vector<HandheldObject> TablewareObjects() {
  return {{"mug", Mug},
          {"teapot", Teapot},
          {"bottle", Bottle},
          {"bowl", Bowl},
          {"wineglass", WineGlass}};
}

}  // namespace holdfast
