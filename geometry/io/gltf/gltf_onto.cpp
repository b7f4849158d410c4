// SPDX-License-Identifier: MIT
#include "geometry/io/gltf/gltf_onto.h"

#include <cstdint>
#include <stdexcept>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "geometry/error.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/io/container/byte_source.h"
#include "geometry/io/container/json_file.h"
#include "geometry/io/gltf/gltf_skeleton.h"
#include "geometry/io/gltf/gltf_writer.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

using Json = nlohmann::ordered_json;

// Rotation of each joint (per frame) relative to its parent, as stored in the animation; `places`
// becomes the translation of the pelvis. Joints above the first moving joint keep their pose.
std::vector<std::vector<Eigen::Quaterniond>> Localize(const GltfAsset& asset, const GltfRig& rig,
                                                      const SourceMotion& motion, int pelvis,
                                                      Eigen::Matrix3Xf& places) {
  const std::size_t joints = rig.nodes.size();
  std::vector<std::vector<Eigen::Quaterniond>> rotations(joints);
  Eigen::Affine3d above = Eigen::Affine3d::Identity();
  for (int n = asset.NodeAt(rig.nodes[0]).parent; n >= 0; n = asset.NodeAt(n).parent) {
    above = asset.NodeAt(n).Local() * above;
  }
  std::vector<bool> moves(joints, false);
  for (std::size_t k = 0; k < joints; ++k) {
    const int parent = motion.parents[k];
    moves[k] = static_cast<int>(k) == pelvis || (parent >= 0 && moves[parent]);
  }
  const auto frames = static_cast<std::size_t>(motion.NumFrames());
  places.resize(3, motion.NumFrames());
  std::vector<Eigen::Affine3d> world(joints);
  for (std::size_t t = 0; t < frames; ++t) {
    for (std::size_t k = 0; k < joints; ++k) {
      const GltfNode& node = asset.NodeAt(rig.nodes[k]);
      const int parent = motion.parents[k];
      const Eigen::Affine3d& outer = parent < 0 ? above : world[parent];
      Eigen::Affine3d own = node.Local();
      if (moves[k]) {
        const Eigen::Matrix3d R =
            motion.Rotation(static_cast<int>(t), static_cast<int>(k)) * rig.rest_rotations[k];
        const Eigen::Quaterniond turn(
            Eigen::Matrix3d(RotationWithin(outer.linear()).transpose() * R));
        Eigen::Vector3d place = node.translation;
        if (static_cast<int>(k) == pelvis) {
          place = outer.inverse() * motion.positions[t].col(pelvis);
          places.col(static_cast<Eigen::Index>(t)) = place.cast<float>();
        }
        rotations[k].push_back(turn);
        own = Eigen::Translation3d(place) * turn * Eigen::Scaling(node.scale);
      }
      world[k] = outer * own;
    }
  }
  return rotations;
}

// A glTF as its JSON and one block of bytes.
struct Scene {
  Json json;
  std::string binary;

  void Align() { binary.resize((binary.size() + 3) / 4 * 4); }
};

Scene ParseScene(const GltfAsset& asset, const std::filesystem::path& character) {
  const std::string bytes = ReadGzipText(character);
  Scene scene;
  scene.json = Json::parse(SplitGltf(bytes, character.string()).json);
  Json& root = scene.json;
  std::vector<std::size_t> begin;
  for (std::size_t b = 0; b < root.value("buffers", Json::array()).size(); ++b) {
    scene.Align();
    begin.push_back(scene.binary.size());
    scene.binary += asset.BufferBytes(static_cast<int>(b));
  }
  const auto move = [&](Json& view) {
    if (!view.is_object() || !view.contains("buffer")) return;
    view["byteOffset"] =
        view.value("byteOffset", std::size_t{0}) + begin.at(view["buffer"].get<std::size_t>());
    view["buffer"] = 0;
  };
  if (!root.contains("bufferViews")) root["bufferViews"] = Json::array();
  for (Json& view : root["bufferViews"]) {
    move(view);
    if (!view.contains("extensions")) continue;
    for (auto& [name, extension] : view["extensions"].items()) move(extension);
  }
  if (!root.contains("scenes")) {
    root["scene"] = 0;
    root["scenes"] = Json::array({{{"nodes", asset.scene_roots}}});
  }
  if (!root.contains("images")) return scene;
  for (Json& image : root["images"]) {
    if (!image.contains("uri")) continue;
    const std::filesystem::path file = ResolveGltfUri(image["uri"].get<std::string>(),
                                                      character.parent_path(), character.string());
    if (file.empty()) continue;  // embedded in the text
    const std::string content = ReadFile(file);
    scene.Align();
    image.erase("uri");
    image["mimeType"] = content.starts_with("\x89PNG") ? "image/png" : "image/jpeg";
    image["bufferView"] = root["bufferViews"].size();
    root["bufferViews"].push_back(
        {{"buffer", 0}, {"byteOffset", scene.binary.size()}, {"byteLength", content.size()}});
    scene.binary += content;
  }
  return scene;
}

Scene ReadScene(const GltfAsset& asset, const std::filesystem::path& character) {
  try {
    return ParseScene(asset, character);
  } catch (const Json::exception& fault) {
    throw Error(character.string(), fmt::format("is malformed: {}", fault.what()),
                "Export it again");
  } catch (const std::out_of_range&) {
    throw Error(character.string(), "refers to a buffer that it does not have", "Export it again");
  }
}

// Appends the content of `builder`, whose first nodes correspond to `nodes` of the scene.
void Append(const GltfBuilder& builder, const std::vector<int>& nodes, Scene& scene) {
  const std::string bytes = builder.Bytes();
  const GltfContainer parts = SplitGltf(bytes, "animation");
  Json added = Json::parse(parts.json);
  Json& root = scene.json;
  scene.Align();
  const std::size_t offset = scene.binary.size();
  scene.binary += parts.binary;
  const auto size = [&](const char* key) { return root.value(key, Json::array()).size(); };
  const std::size_t views = size("bufferViews"), accessors = size("accessors"),
                    images = size("images"), textures = size("textures"),
                    materials = size("materials"), meshes = size("meshes"),
                    first_node = size("nodes");
  const auto shift = [](Json& object, const char* key, std::size_t by) {
    if (object.contains(key)) object[key] = object[key].get<std::size_t>() + by;
  };
  const auto append = [&](const char* key, const auto& adapt) {
    if (!added.contains(key)) return;
    for (Json& item : added[key]) {
      adapt(item);
      root[key].push_back(std::move(item));
    }
  };
  append("bufferViews", [&](Json& view) {
    view["byteOffset"] = view.value("byteOffset", std::size_t{0}) + offset;
  });
  append("accessors", [&](Json& accessor) { shift(accessor, "bufferView", views); });
  append("images", [&](Json& image) { shift(image, "bufferView", views); });
  append("textures", [&](Json& texture) { shift(texture, "source", images); });
  append("materials", [&](Json& material) {
    Json& pbr = material["pbrMetallicRoughness"];
    if (pbr.contains("baseColorTexture")) shift(pbr["baseColorTexture"], "index", textures);
  });
  append("meshes", [&](Json& mesh) {
    for (Json& primitive : mesh["primitives"]) {
      shift(primitive, "indices", accessors);
      shift(primitive, "material", materials);
      for (auto& [name, accessor] : primitive["attributes"].items()) {
        accessor = accessor.get<std::size_t>() + accessors;
      }
    }
  });
  const auto place_of = [&](std::size_t node) {
    return node < nodes.size() ? static_cast<std::size_t>(nodes[node])
                               : first_node + node - nodes.size();
  };
  const std::size_t shown = root.value("scene", std::size_t{0});
  for (std::size_t n = 0; n < added["nodes"].size(); ++n) {
    Json& node = added["nodes"][n];
    if (n < nodes.size()) {
      // Pose of the first frame.
      Json& own = root["nodes"][place_of(n)];
      for (const char* key : {"rotation", "translation"}) {
        if (node.contains(key)) own[key] = node[key];
      }
      continue;
    }
    shift(node, "mesh", meshes);
    root["nodes"].push_back(std::move(node));
    root["scenes"][shown]["nodes"].push_back(place_of(n));
  }
  Json& animation = added["animations"][0];
  for (Json& sampler : animation["samplers"]) {
    shift(sampler, "input", accessors);
    shift(sampler, "output", accessors);
  }
  for (Json& channel : animation["channels"]) {
    channel["target"]["node"] = place_of(channel["target"]["node"].get<std::size_t>());
  }
  root["animations"] = Json::array({std::move(animation)});
}

std::string GlbBytes(Scene& scene) {
  scene.Align();
  scene.json["buffers"] = Json::array({{{"byteLength", scene.binary.size()}}});
  std::string text = JsonText(scene.json);
  text.resize((text.size() + 3) / 4 * 4, ' ');
  const std::size_t total = 12 + 8 + text.size() + 8 + scene.binary.size();
  if (total > kMaxGltfBytes) {
    throw Error("the clip", "makes a glTF of more than 4 GB, which the format cannot hold",
                "Export a part of it");
  }
  std::string bytes;
  const auto word = [&](std::size_t value) {
    for (int k = 0; k < 4; ++k) bytes.push_back(static_cast<char>(value >> (8 * k) & 0xff));
  };
  bytes += "glTF";
  word(2);
  word(total);
  word(text.size());
  bytes += "JSON";
  bytes += text;
  word(scene.binary.size());
  bytes.append("BIN\0", 4);
  return bytes + scene.binary;
}

}  // namespace

void WriteGltfOnto(const std::filesystem::path& character, const GltfAsset& asset,
                   const GltfRig& rig, const SourceMotion& motion, int pelvis,
                   const TexturedMesh* object, const std::string& animation,
                   const std::string& generator, const std::filesystem::path& path) {
  Eigen::Matrix3Xf places;
  const auto rotations = Localize(asset, rig, motion, pelvis, places);
  GltfBuilder builder(motion.NumFrames(), motion.frame_rate, generator, animation);
  std::vector<int> nodes;
  Scene scene = ReadScene(asset, character);
  for (std::size_t k = 0; k < rig.nodes.size(); ++k) {
    if (rotations[k].empty()) continue;
    const int node = builder.AddNode({});
    nodes.push_back(rig.nodes[k]);
    builder.Turn(node, ContinuousQuaternions(rotations[k]));
    if (static_cast<int>(k) == pelvis) builder.Shift(node, places);
    // An animated node must not have a matrix.
    Json& own = scene.json["nodes"][static_cast<std::size_t>(rig.nodes[k])];
    if (own.erase("matrix") == 0) continue;
    const GltfNode& read = asset.NodeAt(rig.nodes[k]);
    own["translation"] = ToVector(read.translation);
    own["scale"] = ToVector(read.scale);
  }
  if (object != nullptr && motion.prop) {
    ObjectTrack track;
    track.name = motion.prop->name;
    const Eigen::Matrix3d z_up = YUpFromZUp().transpose();
    track.trans = z_up * motion.prop->positions;
    track.orient.resize(3, motion.NumFrames());
    for (int t = 0; t < motion.NumFrames(); ++t) {
      track.orient.col(t) = LogSO3(z_up * motion.prop->rotations[t].toRotationMatrix());
    }
    builder.AddTracked(*object, track, "object");
  }
  Append(builder, nodes, scene);
  scene.json["asset"]["generator"] = generator;
  scene.json["asset"].erase("extras");  // describe another clip
  WriteAtomically(path, GlbBytes(scene));
}

}  // namespace holdfast
