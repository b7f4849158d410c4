// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <nlohmann/json.hpp>

#include "geometry/io/container/atomic_file.h"

namespace holdfast::testing {

/// A glTF binary evaluated from its bytes alone, by the text of the glTF 2.0 specification: what a
/// viewer would show at a key frame. Knows nothing of the program's own writer.
class GlbFile {
 public:
  explicit GlbFile(const std::filesystem::path& path) : bytes_(ReadFile(path)) {
    if (bytes_.compare(0, 4, "glTF") != 0 || Word(4) != 2 || Word(8) != bytes_.size()) {
      throw std::runtime_error("not a glTF 2.0 binary");
    }
    const std::size_t json_bytes = Word(12);
    json_ = nlohmann::json::parse(bytes_.substr(20, json_bytes));
    binary_ = 20 + json_bytes + 8;
  }

  const nlohmann::json& Json() const { return json_; }

  int Node(const std::string& name) const {
    for (std::size_t n = 0; n < json_["nodes"].size(); ++n) {
      if (json_["nodes"][n].value("name", "") == name) return static_cast<int>(n);
    }
    throw std::runtime_error("no node " + name);
  }

  /// One element per column.
  Eigen::MatrixXd Accessor(int index) const {
    const auto& accessor = json_["accessors"][index];
    const auto& view = json_["bufferViews"][accessor["bufferView"].get<int>()];
    const std::string type = accessor["type"];
    const int rows = type == "SCALAR" ? 1 : type == "VEC3" ? 3 : type == "VEC4" ? 4 : 16;
    const char* at = bytes_.data() + binary_ + view.value("byteOffset", 0u);
    Eigen::MatrixXd values(rows, accessor["count"].get<int>());
    for (double& value : values.reshaped()) {
      switch (accessor["componentType"].get<int>()) {
        case 5121:
          value = Take<std::uint8_t>(at);
          break;
        case 5123:
          value = Take<std::uint16_t>(at);
          break;
        case 5125:
          value = Take<std::uint32_t>(at);
          break;
        case 5126:
          value = Take<float>(at);
          break;
        default:
          throw std::runtime_error("unknown component type");
      }
    }
    return values;
  }

  Eigen::MatrixXd Times() const { return Accessor(json_["animations"][0]["samplers"][0]["input"]); }

  /// World transform of each node at a key frame.
  std::vector<Eigen::Affine3d> Pose(int frame) const {
    const auto& nodes = json_["nodes"];
    std::vector<Eigen::Vector3d> translation(nodes.size(), Eigen::Vector3d::Zero());
    std::vector<Eigen::Quaterniond> rotation(nodes.size(), Eigen::Quaterniond::Identity());
    for (std::size_t n = 0; n < nodes.size(); ++n) {
      if (nodes[n].contains("translation")) {
        for (int c = 0; c < 3; ++c) translation[n][c] = nodes[n]["translation"][c];
      }
      if (nodes[n].contains("rotation")) {
        for (int c = 0; c < 4; ++c) rotation[n].coeffs()[c] = nodes[n]["rotation"][c];
      }
    }
    for (const auto& channel : json_["animations"][0]["channels"]) {
      const int n = channel["target"]["node"];
      const std::string path = channel["target"]["path"];
      if (path == "weights") continue;
      const Eigen::MatrixXd values = Output(channel);
      if (path == "translation") translation[n] = values.col(frame);
      if (path == "rotation") rotation[n].coeffs() = values.col(frame);
    }
    std::vector<Eigen::Affine3d> world(nodes.size());
    for (const int root : json_["scenes"][0]["nodes"]) {
      Descend(root, Eigen::Affine3d::Identity(), translation, rotation, world);
    }
    return world;
  }

  /// Vertices of a node's mesh in the scene at a key frame: morphed, then skinned or placed.
  Eigen::Matrix3Xd Vertices(int node, int frame) const {
    const std::vector<Eigen::Affine3d> world = Pose(frame);
    const auto& mesh = json_["meshes"][json_["nodes"][node]["mesh"].get<int>()];
    const auto& primitive = mesh["primitives"][0];
    const auto& attributes = primitive["attributes"];
    Eigen::Matrix3Xd vertices = Accessor(attributes["POSITION"]);
    if (primitive.contains("targets")) {
      const Eigen::VectorXd weights = MorphWeights(node, frame, primitive["targets"].size());
      for (std::size_t k = 0; k < primitive["targets"].size(); ++k) {
        vertices += weights(k) * Accessor(primitive["targets"][k]["POSITION"]);
      }
    }
    if (!json_["nodes"][node].contains("skin")) return world[node] * vertices;
    const auto& skin = json_["skins"][json_["nodes"][node]["skin"].get<int>()];
    const Eigen::MatrixXd bind = Accessor(skin["inverseBindMatrices"]);
    Eigen::Matrix3Xd skinned = Eigen::Matrix3Xd::Zero(3, vertices.cols());
    for (int set = 0; attributes.contains("JOINTS_" + std::to_string(set)); ++set) {
      const Eigen::MatrixXd joints = Accessor(attributes["JOINTS_" + std::to_string(set)]);
      const Eigen::MatrixXd weights = Accessor(attributes["WEIGHTS_" + std::to_string(set)]);
      for (Eigen::Index v = 0; v < vertices.cols(); ++v) {
        for (int k = 0; k < 4; ++k) {
          if (weights(k, v) == 0) continue;
          const auto joint = static_cast<int>(joints(k, v));
          const Eigen::Matrix4d matrix =
              world[skin["joints"][joint].get<int>()].matrix() * bind.col(joint).reshaped(4, 4);
          skinned.col(v) += weights(k, v) * (matrix * vertices.col(v).homogeneous()).head<3>();
        }
      }
    }
    return skinned;
  }

 private:
  std::uint32_t Word(std::size_t offset) const {
    std::uint32_t word;
    std::memcpy(&word, bytes_.data() + offset, 4);
    return word;
  }

  template <typename T>
  static double Take(const char*& at) {
    T value;
    std::memcpy(&value, at, sizeof value);
    at += sizeof value;
    return value;
  }

  Eigen::MatrixXd Output(const nlohmann::json& channel) const {
    const int sampler = channel["sampler"];
    return Accessor(json_["animations"][0]["samplers"][sampler]["output"]);
  }

  Eigen::VectorXd MorphWeights(int node, int frame, std::size_t count) const {
    const auto size = static_cast<Eigen::Index>(count);
    for (const auto& channel : json_["animations"][0]["channels"]) {
      if (channel["target"]["node"] == node && channel["target"]["path"] == "weights") {
        return Output(channel).reshaped().segment(frame * size, size);
      }
    }
    throw std::runtime_error("morph targets without animation");
  }

  void Descend(int node, const Eigen::Affine3d& parent,
               const std::vector<Eigen::Vector3d>& translation,
               const std::vector<Eigen::Quaterniond>& rotation,
               std::vector<Eigen::Affine3d>& world) const {
    world[node] = parent * Eigen::Translation3d(translation[node]) * rotation[node];
    if (!json_["nodes"][node].contains("children")) return;
    for (const int child : json_["nodes"][node]["children"]) {
      Descend(child, world[node], translation, rotation, world);
    }
  }

  std::string bytes_;
  std::size_t binary_ = 0;
  nlohmann::json json_;
};

}  // namespace holdfast::testing
