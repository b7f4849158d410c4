// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "geometry/mesh/mesh.h"

namespace holdfast {

/// A handheld object: how to make its mesh, in millimetres, z up as it lies or stands on a table.
struct HandheldObject {
  std::string name;
  std::function<TriangleMesh()> make;
};

/// Plain solids and fruit: cube, cylinder, sphere, apple, banana.
std::vector<HandheldObject> SimpleObjects();
/// What stands on a table: mug, teapot, bottle, bowl, wine glass.
std::vector<HandheldObject> TablewareObjects();
/// What has a grip: hammer, knife, frying pan, toothbrush, flashlight.
std::vector<HandheldObject> ToolObjects();
/// Camera, phone, light bulb.
std::vector<HandheldObject> DeviceObjects();

/// All of them, sorted by name.
std::vector<HandheldObject> HandheldObjects();

/// The mesh in metres, origin at the centre of the bottom of its bounding box, coordinates rounded
/// to single precision: every file format holds them exactly.
TriangleMesh PlaceOnTable(TriangleMesh mesh_mm);

}  // namespace holdfast
