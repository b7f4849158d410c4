// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <deque>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace holdfast {

/// A node in the pose of the file, relative to its parent.
struct GltfNode {
  std::string name;  ///< empty if the file has none
  int parent = -1;
  std::vector<int> children;
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d scale = Eigen::Vector3d::Ones();
  int mesh = -1;
  int skin = -1;

  Eigen::Affine3d Local() const {
    return Eigen::Translation3d(translation) * rotation * Eigen::Scaling(scale);
  }
};

struct GltfBufferView {
  int buffer = 0;
  std::size_t offset = 0, bytes = 0, stride = 0;  ///< stride 0: elements are contiguous
  bool compressed = false;                        ///< EXT_meshopt_compression
};

struct GltfAccessor {
  int view = -1;  ///< -1: zeros
  std::size_t offset = 0, count = 0;
  int component = 0;  ///< 5120 int8, 5121 uint8, 5122 int16, 5123 uint16, 5125 uint32, 5126 float
  int rows = 1;       ///< numbers per element: 1 SCALAR, 2 to 4 VEC, 16 MAT4, ...
  bool normalized = false;
  std::size_t sparse_count = 0;  ///< elements that are stored separately
  int sparse_index_view = -1, sparse_index_component = 0, sparse_value_view = -1;
  std::size_t sparse_index_offset = 0, sparse_value_offset = 0;
};

struct GltfSkin {
  std::string name;
  std::vector<int> joints;  ///< nodes
  int inverse_bind = -1;    ///< accessor
};

enum class GltfPath { kTranslation, kRotation, kScale };
enum class GltfInterpolation { kLinear, kStep, kCubicSpline };

/// Animation of one property of one node.
struct GltfChannel {
  int node;
  GltfPath path;
  int input, output;  ///< accessors: times, values
  GltfInterpolation interpolation;
};

struct GltfAnimation {
  std::string name;
  std::vector<GltfChannel> channels;  ///< of nodes; morph weights and pointers are ignored
};

struct GltfPrimitive {
  int positions = -1, indices = -1, normals = -1;  ///< accessors
  int uv = -1;                                     ///< accessor of the set that the material uses
  int material = -1;
  int mode = 4;  ///< 4: triangles
};

/// Colors are factors: an image multiplies them.
struct GltfMaterial {
  std::string name;
  Eigen::Vector4d color = Eigen::Vector4d::Ones();  ///< linear red, green, blue, and opacity
  double metallic = 1.0, roughness = 1.0;
  int image = -1;
  int uv_set = 0;
};

/// Location of an image's bytes.
struct GltfImage {
  int view = -1;
  std::string uri;  ///< used without a view
};

struct GltfMesh {
  std::string name;
  std::vector<GltfPrimitive> primitives;
};

/// The parts of a glTF 2.0 file that move a body and show an object in its hands: nodes, skins,
/// animations, materials of one color or image, and the numbers behind them. Cameras and lights are
/// ignored. All indices are in range and nodes form trees; accessors are checked against their
/// buffers when they are used (GltfNumbers). No memory is allocated for data that a file only
/// announces.
class GltfAsset {
 public:
  GltfAsset(GltfAsset&&) = default;
  GltfAsset& operator=(GltfAsset&&) = default;

  /// Reads a file (plain or gzipped). Throws Error.
  static GltfAsset Read(const std::filesystem::path& path);
  /// Same for a file's bytes; buffers with a file name are searched in `folder`.
  static GltfAsset Parse(std::string bytes, const std::string& where,
                         const std::filesystem::path& folder);

  const std::string& Where() const { return where_; }
  /// Size of the file and its separate buffers.
  std::size_t NumBytes() const { return num_bytes_; }

  std::vector<GltfNode> nodes;
  std::vector<int> order;        ///< all nodes, parents before children
  std::vector<int> scene_roots;  ///< of the scene to show
  std::vector<GltfMaterial> materials;
  std::vector<GltfImage> images;
  std::vector<GltfMesh> meshes;
  std::vector<GltfSkin> skins;
  std::vector<GltfAnimation> animations;
  std::vector<GltfAccessor> accessors;
  std::vector<GltfBufferView> views;
  std::map<std::string, int> humanoid;  ///< bone to node by VRM's extension; else empty
  // What Holdfast's own files state about their clip in `asset.extras`; empty for other files.
  double clip_frame_rate = 0;  ///< Hz, 0 if not stated
  Eigen::VectorXd clip_betas;
  std::string clip_gender, clip_body_model;

  const GltfNode& NodeAt(int node) const { return nodes[node]; }
  std::string_view BufferBytes(int buffer) const { return buffers_[buffer]; }
  /// Returns an image file unchanged. Throws Error if it is missing or outside the folder.
  std::string ImageBytes(int image) const;
  /// Node for messages: "'hips' (node 3)".
  std::string NodeText(int node) const;

 private:
  friend class GltfParser;
  GltfAsset() = default;

  std::string where_;
  std::filesystem::path folder_;
  std::size_t num_bytes_ = 0;
  std::deque<std::string> bytes_;          // of the file, then of buffers outside its binary chunk
  std::vector<std::string_view> buffers_;  // in `bytes_`; empty for a missing one
};

/// Numbers of an accessor, decoded one at a time from the buffer.
class GltfNumbers {
 public:
  /// Throws Error unless the accessor has `rows` numbers per element.
  GltfNumbers(const GltfAsset& asset, int accessor, int rows);

  std::size_t Count() const { return count_; }
  /// Number `row` of element `i`; normalized integers become the fractions they represent.
  double operator()(std::size_t i, int row) const;

 private:
  double Decode(const char* at) const;

  const char* dense_ = nullptr;  // nullptr: zeros
  const char* sparse_indices_ = nullptr;
  const char* sparse_values_ = nullptr;
  std::size_t count_ = 0, stride_ = 0, element_ = 0, component_bytes_ = 0, sparse_count_ = 0;
  int component_ = 0, index_component_ = 0;
  bool normalized_ = false;
};

}  // namespace holdfast
