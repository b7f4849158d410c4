// SPDX-License-Identifier: MIT
#pragma once

/// Mesh files: `.obj`, `.ply`, `.stl`, `.off`, `.glb`, `.gltf` or the name of an embedded object
/// come in; triangles, named parts, materials and objects ready for fitting come out.
///
/// From the inside out:
///   mesh_scan.h      polygons of a file, checked
///   mesh_io.h        ReadMeshFile, WriteMesh: meshes as stored
///   mesh_groups.h    named parts, regions by vertex lists
///   gltf_mesh.h      triangles and materials of a glTF file
///   textured_mesh.h  materials and images, for display
///   load_object.h    an object, repaired and scaled
#include "geometry/io/mesh/load_object.h"
#include "geometry/io/mesh/mesh_groups.h"
#include "geometry/io/mesh/mesh_io.h"
#include "geometry/io/mesh/textured_mesh.h"
