// SPDX-License-Identifier: MIT
#include "apps/grasp_place_input.h"

#include <filesystem>
#include <string_view>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "geometry/error.h"
#include "geometry/io/mesh/mesh_groups.h"
#include "geometry/io/mesh/mesh_io.h"
#include "geometry/mesh/append.h"
#include "geometry/suggestion.h"

namespace holdfast::apps {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void Unknown(const char* option, const std::string& name,
                          const std::vector<MeshGroup>& groups, const std::string& object) {
  const std::string where = fmt::format("{} {}", option, name);
  if (groups.empty()) {
    throw Error(
        where, fmt::format("is not a file, and {} has no named parts", object),
        "Parts are groups, objects and materials of an .obj file; or give a file that lists "
        "vertices, or a point with --at");
  }
  std::vector<std::string> names;
  for (const MeshGroup& group : groups) names.push_back(group.name);
  throw Error(where, fmt::format("is neither a part of {} nor a file", object),
              fmt::format("{}It has: {}", Suggestion(name, names), fmt::join(names, ", ")));
}

// The faces of all parts that are named, in the file's unit.
TriangleMesh SurfaceNamed(const char* option, const std::vector<std::string>& asked,
                          const std::vector<MeshGroup>& groups, const std::string& object) {
  TriangleMesh surface;
  surface.vertices.resize(3, 0);
  surface.faces.resize(3, 0);
  for (const std::string& name : asked) {
    bool found = false;
    for (const MeshGroup& group : groups) {
      if (group.name != name) continue;
      Append(group.surface, surface);
      found = true;
    }
    if (found) continue;
    if (!fs::is_regular_file(name)) Unknown(option, name, groups, object);
    if (!fs::is_regular_file(object)) {
      throw Error(fmt::format("{} {}", option, name),
                  fmt::format("lists vertices of a file, which {} is not", object),
                  "Give the object as a file");
    }
    const TriangleMesh mesh = ReadMesh(object);
    try {
      Append(ReadVertexRegion(name, mesh), surface);
    } catch (const Error& error) {
      throw Error(fmt::format("{} {}", option, error.Where()), error.Problem(), error.Remedy());
    }
  }
  return surface;
}

}  // namespace

void AddGraspPlaceOptions(CLI::App& command, GraspPlaceInput& input, const std::string& group) {
  command
      .add_option("--at", input.at,
                  "Take hold at this point of the object: X,Y,Z in its own frame, metres, scaled")
      ->delimiter(',')
      ->expected(3)
      ->type_name("X,Y,Z")
      ->group(group);
  command
      .add_option("--region", input.region,
                  "Take hold on this part alone: a group, object or material of the .obj file, or "
                  "a file with the numbers of its vertices, from 0. May be repeated")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->type_name("NAME|FILE")
      ->group(group);
  command.add_option("--avoid", input.avoid, "Touch nothing of this part; named as for --region")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->type_name("NAME|FILE")
      ->group(group);
}

std::optional<GraspPlace::Wanted> WantedPlace(const GraspPlaceInput& input,
                                              const std::string& path_or_name, double scale) {
  if (!input.Given()) return std::nullopt;
  std::vector<MeshGroup> groups;
  if (fs::is_regular_file(path_or_name)) groups = ReadMeshGroups(path_or_name);
  GraspPlace::Wanted wanted;
  wanted.region = SurfaceNamed("--region", input.region, groups, path_or_name);
  wanted.avoid = SurfaceNamed("--avoid", input.avoid, groups, path_or_name);
  wanted.region.vertices *= scale;
  wanted.avoid.vertices *= scale;
  if (!input.at.empty()) wanted.at = Eigen::Vector3d(input.at[0], input.at[1], input.at[2]);
  return wanted;
}

nlohmann::json GraspPlaceJson(const GraspPlaceInput& input) {
  if (!input.Given()) return nullptr;
  return {{"at_m", input.at}, {"region", input.region}, {"avoid", input.avoid}};
}

}  // namespace holdfast::apps
