// SPDX-License-Identifier: MIT
#include "geometry/io/gltf/asset/gltf_asset.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "geometry/error.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/io/container/byte_source.h"
#include "geometry/io/container/json_file.h"
#include "geometry/io/gltf/asset/gltf_container.h"

namespace holdfast {
namespace {

using nlohmann::json;

constexpr std::size_t kMaxNodes = 100'000;
constexpr std::size_t kMaxBufferBytes = std::size_t{4} << 30;
constexpr std::size_t kMaxImageBytes = std::size_t{256} << 20;
constexpr std::int64_t kMaxInteger = std::int64_t{1} << 53;
constexpr std::string_view kExportAgain =
    "Export the file again (the Khronos glTF validator gives details)";

// One entry of a list in the file, with checked access to its fields.
class Entry {
 public:
  Entry(const json& value, const std::string& file, std::string place)
      : value_(&value), file_(&file), place_(std::move(place)) {
    if (!value.is_object()) Fail("", "is not a JSON object");
  }

  [[noreturn]] void Fail(std::string_view key, std::string_view problem) const {
    throw Error(fmt::format("{}{}{}", *file_, place_, key.empty() ? "" : fmt::format("[{}]", key)),
                problem, kExportAgain);
  }

  const json* Find(const char* key) const {
    const auto found = value_->find(key);
    return found == value_->end() || found->is_null() ? nullptr : &*found;
  }

  // Whole number in [0, limit); `fallback` if the file has none.
  int Index(const char* key, std::int64_t limit, int fallback = -1) const {
    return Find(key) == nullptr ? fallback : RequireIndex(key, limit);
  }
  int RequireIndex(const char* key, std::int64_t limit) const {
    return static_cast<int>(Whole(Need(key), key, limit));
  }
  // Number of bytes or elements; 0 if the file has none.
  std::size_t Count(const char* key) const { return Find(key) == nullptr ? 0 : RequireCount(key); }
  std::size_t RequireCount(const char* key) const {
    return static_cast<std::size_t>(Whole(Need(key), key, kMaxInteger));
  }
  const json& Need(const char* key) const {
    const json* found = Find(key);
    if (found == nullptr) Fail(key, "is missing");
    return *found;
  }
  std::int64_t Whole(const json& number, const char* key, std::int64_t limit) const {
    std::int64_t value = -1;
    if (number.is_number_unsigned()) {
      const auto raw = number.get<std::uint64_t>();
      if (raw < static_cast<std::uint64_t>(kMaxInteger)) value = static_cast<std::int64_t>(raw);
    } else if (number.is_number_float()) {  // "3.0" from careless writers
      const auto raw = number.get<double>();
      if (raw >= 0 && raw < static_cast<double>(kMaxInteger) && raw == std::floor(raw)) {
        value = static_cast<std::int64_t>(raw);
      }
    }
    if (value < 0 || value >= limit) {
      Fail(key, fmt::format("is {}, but a whole number from 0 to {} is needed", Shown(number),
                            limit - 1));
    }
    return value;
  }

  template <typename Vector>
  bool Numbers(const char* key, Vector& out) const {
    const json* found = Find(key);
    if (found == nullptr) return false;
    if (!found->is_array() || found->size() != static_cast<std::size_t>(out.size())) {
      Fail(key, fmt::format("is not a list of {} numbers", out.size()));
    }
    for (Eigen::Index k = 0; k < out.size(); ++k) {
      const json& number = (*found)[static_cast<std::size_t>(k)];
      if (!number.is_number() || !std::isfinite(number.get<double>())) {
        Fail(key, fmt::format("holds {}", Shown(number)));
      }
      out[k] = number.get<double>();
    }
    return true;
  }

  double Number(const char* key, double fallback) const {
    const json* found = Find(key);
    if (found == nullptr) return fallback;
    if (!found->is_number() || !std::isfinite(found->get<double>())) {
      Fail(key, fmt::format("holds {}", Shown(*found)));
    }
    return found->get<double>();
  }

  std::string Text(const char* key) const {
    const json* found = Find(key);
    return found != nullptr && found->is_string() ? found->get<std::string>() : std::string();
  }

  // A list in the file; empty if there is none.
  const json& List(const char* key) const {
    static const json kEmpty = json::array();
    const json* found = Find(key);
    if (found == nullptr) return kEmpty;
    if (!found->is_array()) Fail(key, "is not a list");
    return *found;
  }
  Entry Inner(const json& value, const char* key) const {
    return {value, *file_, fmt::format("{}[{}]", place_, key)};
  }
  Entry Inner(const json& value, const char* key, std::size_t index) const {
    return {value, *file_, fmt::format("{}[{}][{}]", place_, key, index)};
  }

 private:
  static std::string Shown(const json& value) {
    return value.is_structured()
               ? std::string("a list or an object")
               : value.dump(-1, ' ', true, json::error_handler_t::replace).substr(0, 40);
  }

  const json* value_;
  const std::string* file_;
  std::string place_;
};

// Splits a matrix into scale, rotation and translation; a reflection goes into the scale of x.
void TakeMatrix(const Eigen::Matrix4d& matrix, GltfNode& node) {
  Eigen::Matrix3d linear = matrix.topLeftCorner<3, 3>();
  node.translation = matrix.topRightCorner<3, 1>();
  node.scale = linear.colwise().norm();
  if (linear.determinant() < 0) node.scale.x() = -node.scale.x();
  for (int c = 0; c < 3; ++c) {
    if (std::abs(node.scale[c]) < 1e-12) return;  // flat: invisible
    linear.col(c) /= node.scale[c];
  }
  node.rotation = Eigen::Quaterniond(linear).normalized();
}

int ComponentsOf(const std::string& type) {
  constexpr std::pair<std::string_view, int> kTypes[] = {
      {"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4}, {"MAT2", 4}, {"MAT3", 9}, {"MAT4", 16}};
  for (const auto& [name, count] : kTypes) {
    if (type == name) return count;
  }
  return 0;
}

}  // namespace

class GltfParser {
 public:
  GltfParser(GltfAsset& asset, const std::filesystem::path& folder)
      : asset_(asset), folder_(folder) {}

  void Run() {
    const std::string& bytes = asset_.bytes_.front();
    const GltfContainer parts = SplitGltf(bytes, asset_.where_);
    asset_.num_bytes_ = bytes.size();
    const json document = ParseJsonWithin(parts.json, asset_.where_, bytes.size());
    const Entry root(document, asset_.where_, "");
    Asset(root);
    Buffers(root, parts.binary);
    Each(root, "bufferViews", [&](const Entry& entry) { View(entry); });
    Each(root, "accessors", [&](const Entry& entry) { Accessor(entry); });
    Each(root, "images", [&](const Entry& entry) {
      asset_.images.push_back({entry.Index("bufferView", Size(asset_.views)), entry.Text("uri")});
    });
    // A texture without a source is in a format of an extension.
    Each(root, "textures", [&](const Entry& entry) {
      image_of_texture_.push_back(entry.Index("source", Size(asset_.images)));
    });
    Each(root, "materials", [&](const Entry& entry) { Material(entry); });
    Each(root, "meshes", [&](const Entry& entry) { Mesh(entry); });
    Nodes(root);
    Each(root, "skins", [&](const Entry& entry) { Skin(entry); });
    Each(root, "animations", [&](const Entry& entry) { Animation(entry); });
    Humanoid(root);
  }

 private:
  template <typename Take>
  static void Each(const Entry& root, const char* key, const Take& take) {
    const json& list = root.List(key);
    for (std::size_t i = 0; i < list.size(); ++i) take(root.Inner(list[i], key, i));
  }

  static std::int64_t Size(const auto& list) { return static_cast<std::int64_t>(list.size()); }

  void Asset(const Entry& root) {
    const json* found = root.Find("asset");
    if (found == nullptr) root.Fail("asset", "is missing: this is not glTF");
    const Entry asset = root.Inner(*found, "asset");
    if (const std::string version = asset.Text("version"); !version.starts_with("2.")) {
      throw Error(asset_.where_, fmt::format("is glTF of version '{}'", version.substr(0, 20)),
                  "Export glTF 2.0");
    }
    const json* extras = asset.Find("extras");
    if (!asset.Text("generator").starts_with("Holdfast") || extras == nullptr ||
        !extras->is_object()) {
      return;
    }
    const Entry own = asset.Inner(*extras, "extras");
    if (const json* number = own.Find("frame_rate"); number != nullptr && number->is_number()) {
      const double rate = number->get<double>();
      if (std::isfinite(rate) && rate > 0) asset_.clip_frame_rate = rate;
    }
    asset_.clip_betas.resize(
        static_cast<Eigen::Index>(std::min<std::size_t>(own.List("betas").size(), 1000)));
    own.Numbers("betas", asset_.clip_betas);
    asset_.clip_gender = own.Text("gender");
    asset_.clip_body_model = own.Text("body_model");
  }

  // VRM 1.0: {"hips": {"node": 3}, ...}; VRM 0.x: [{"bone": "hips", "node": 3}, ...].
  void Humanoid(const Entry& root) {
    const json* found = root.Find("extensions");
    if (found == nullptr || !found->is_object()) return;
    const Entry extensions = root.Inner(*found, "extensions");
    for (const char* name : {"VRMC_vrm", "VRM"}) {
      const json* vrm = extensions.Find(name);
      if (vrm == nullptr || !vrm->is_object()) continue;
      const Entry extension = extensions.Inner(*vrm, name);
      const json* humanoid = extension.Find("humanoid");
      if (humanoid == nullptr || !humanoid->is_object()) continue;
      const Entry map = extension.Inner(*humanoid, "humanoid");
      const json* bones = map.Find("humanBones");
      if (bones == nullptr || !bones->is_structured()) continue;
      for (const auto& [key, value] : bones->items()) {
        if (!value.is_object()) continue;
        const Entry bone = map.Inner(value, "humanBones");
        const auto node = bone.Index("node", Size(asset_.nodes));
        if (node >= 0) asset_.humanoid.emplace(bones->is_array() ? bone.Text("bone") : key, node);
      }
      if (!asset_.humanoid.empty()) return;
    }
  }

  void Buffers(const Entry& root, std::string_view chunk) {
    std::map<std::filesystem::path, std::string_view> seen;
    Each(root, "buffers", [&](const Entry& entry) {
      const std::size_t index = asset_.buffers_.size();
      const auto expected = entry.RequireCount("byteLength");
      const json* uri = entry.Find("uri");
      if (uri != nullptr && !uri->is_string()) entry.Fail("uri", "is not text");
      std::string where = fmt::format("{}[buffers][{}]", asset_.where_, index);
      std::string_view& bytes = asset_.buffers_.emplace_back();
      if (uri == nullptr) {
        // The chunk of a .glb, or a placeholder that a compressed buffer is decoded into.
        if (index > 0 || chunk.data() == nullptr) return;
        bytes = chunk;
      } else {
        const auto& text = uri->get_ref<const std::string&>();
        const std::filesystem::path file = ResolveGltfUri(text, folder_, where);
        if (file.empty()) {
          bytes = asset_.bytes_.emplace_back(DecodeDataUri(text, where));
        } else if (const auto known = seen.find(file); known != seen.end()) {
          bytes = known->second;
        } else {
          bytes = asset_.bytes_.emplace_back(ReadFile(file, kMaxBufferBytes - asset_.num_bytes_));
          asset_.num_bytes_ += bytes.size();
          seen.emplace(file, bytes);
        }
      }
      const std::size_t have = bytes.size();
      if (have < expected) {
        throw Error(where, fmt::format("declares {} bytes but has {}", expected, have),
                    "Fetch the file again, with the .bin that belongs to it");
      }
    });
  }

  void View(const Entry& entry) {
    GltfBufferView view;
    view.buffer = entry.RequireIndex("buffer", Size(asset_.buffers_));
    view.offset = entry.Count("byteOffset");
    view.bytes = entry.RequireCount("byteLength");
    view.stride = static_cast<std::size_t>(entry.Index("byteStride", 1 << 16, 0));
    const json* extensions = entry.Find("extensions");
    view.compressed = extensions != nullptr && extensions->is_object() &&
                      (extensions->contains("EXT_meshopt_compression") ||
                       extensions->contains("KHR_meshopt_compression"));
    asset_.views.push_back(view);
  }

  void Accessor(const Entry& entry) {
    const auto views = Size(asset_.views);
    const auto component = [](const Entry& from, const char* key) {
      const int value = from.RequireIndex(key, 6000);
      if (value != 5120 && value != 5121 && value != 5122 && value != 5123 && value != 5125 &&
          value != 5126) {
        from.Fail(key, fmt::format("is {}, which is not a type of glTF 2.0", value));
      }
      return value;
    };
    GltfAccessor accessor;
    accessor.view = entry.Index("bufferView", views);
    accessor.offset = entry.Count("byteOffset");
    accessor.count = entry.RequireCount("count");
    accessor.component = component(entry, "componentType");
    accessor.rows = ComponentsOf(entry.Text("type"));
    if (accessor.rows == 0)
      entry.Fail("type", "is none of SCALAR, VEC2, VEC3, VEC4, MAT2, MAT3, MAT4");
    const json* normalized = entry.Find("normalized");
    accessor.normalized =
        normalized != nullptr && normalized->is_boolean() && normalized->get<bool>();
    if (const json* found = entry.Find("sparse")) {
      const Entry sparse = entry.Inner(*found, "sparse");
      accessor.sparse_count = sparse.RequireCount("count");
      const json* indices = sparse.Find("indices");
      const json* values = sparse.Find("values");
      if (indices == nullptr || values == nullptr) sparse.Fail("", "lacks its indices or values");
      const Entry from = sparse.Inner(*indices, "indices"), to = sparse.Inner(*values, "values");
      accessor.sparse_index_view = from.RequireIndex("bufferView", views);
      accessor.sparse_index_offset = from.Count("byteOffset");
      accessor.sparse_index_component = component(from, "componentType");
      accessor.sparse_value_view = to.RequireIndex("bufferView", views);
      accessor.sparse_value_offset = to.Count("byteOffset");
    }
    asset_.accessors.push_back(accessor);
  }

  void Material(const Entry& entry) {
    GltfMaterial material;
    material.name = entry.Text("name");
    if (const json* found = entry.Find("pbrMetallicRoughness")) {
      const Entry pbr = entry.Inner(*found, "pbrMetallicRoughness");
      pbr.Numbers("baseColorFactor", material.color);
      material.metallic = pbr.Number("metallicFactor", 1.0);
      material.roughness = pbr.Number("roughnessFactor", 1.0);
      if (const json* used = pbr.Find("baseColorTexture")) {
        const Entry use = pbr.Inner(*used, "baseColorTexture");
        material.image = image_of_texture_[static_cast<std::size_t>(
            use.RequireIndex("index", Size(image_of_texture_)))];
        material.uv_set = use.Index("texCoord", 1000, 0);
      }
    }
    asset_.materials.push_back(std::move(material));
  }

  void Mesh(const Entry& entry) {
    GltfMesh mesh;
    mesh.name = entry.Text("name");
    const auto accessors = Size(asset_.accessors);
    Each(entry, "primitives", [&](const Entry& from) {
      GltfPrimitive primitive;
      primitive.indices = from.Index("indices", accessors);
      primitive.mode = from.Index("mode", 7, 4);
      primitive.material = from.Index("material", Size(asset_.materials));
      if (const json* found = from.Find("attributes")) {
        const Entry attributes = from.Inner(*found, "attributes");
        const auto accessor = [&](const std::string& name) {
          return attributes.Index(name.c_str(), accessors);
        };
        primitive.positions = accessor("POSITION");
        primitive.normals = accessor("NORMAL");
        const auto material = static_cast<std::size_t>(primitive.material);
        const int set = primitive.material < 0 ? 0 : asset_.materials[material].uv_set;
        primitive.uv = accessor(fmt::format("TEXCOORD_{}", set));
      }
      mesh.primitives.push_back(primitive);
    });
    asset_.meshes.push_back(std::move(mesh));
  }

  void Nodes(const Entry& root) {
    const json& list = root.List("nodes");
    if (list.size() > kMaxNodes) {
      throw Error(asset_.where_,
                  fmt::format("has {} nodes, but at most {} are supported", list.size(), kMaxNodes),
                  "Export the character alone");
    }
    asset_.nodes.resize(list.size());
    const json* skins = root.Find("skins");
    const std::int64_t num_skins = skins != nullptr && skins->is_array() ? Size(*skins) : 0;
    for (std::size_t i = 0; i < list.size(); ++i) {
      const Entry entry = root.Inner(list[i], "nodes", i);
      GltfNode& node = asset_.nodes[i];
      node.name = entry.Text("name");
      node.mesh = entry.Index("mesh", Size(asset_.meshes));
      node.skin = entry.Index("skin", num_skins);
      Eigen::Matrix4d matrix;
      Eigen::Map<Eigen::Matrix<double, 16, 1>> flat(matrix.data());
      if (entry.Numbers("matrix", flat)) TakeMatrix(matrix, node);
      entry.Numbers("translation", node.translation);
      entry.Numbers("scale", node.scale);
      if (entry.Numbers("rotation", node.rotation.coeffs())) {
        if (!(node.rotation.norm() > 1e-6 && node.rotation.norm() < 1e6)) {
          entry.Fail("rotation", "is a quaternion of zero or infinite length");
        }
        node.rotation.normalize();
      }
      const json& children = entry.List("children");
      node.children.reserve(children.size());
      for (const json& child : children) {
        const std::int64_t c = entry.Whole(child, "children", Size(list));
        int& parent = asset_.nodes[c].parent;
        if (parent >= 0) {
          entry.Fail("children",
                     fmt::format("lists node {}, which is already a child of node {}", c, parent));
        }
        parent = static_cast<int>(i);
        node.children.push_back(static_cast<int>(c));
      }
    }
    Order();
    const auto scenes = Size(root.List("scenes"));
    if (scenes == 0) return;
    const auto shown = static_cast<std::size_t>(root.Index("scene", scenes, 0));
    const Entry scene = root.Inner(root.List("scenes")[shown], "scenes", shown);
    for (const json& node : scene.List("nodes")) {
      asset_.scene_roots.push_back(
          static_cast<int>(scene.Whole(node, "nodes", Size(asset_.nodes))));
    }
  }

  // Nodes that no root reaches form a cycle.
  void Order() {
    std::vector<int>& order = asset_.order;
    order.reserve(asset_.nodes.size());
    for (std::size_t i = 0; i < asset_.nodes.size(); ++i) {
      if (asset_.nodes[i].parent < 0) order.push_back(static_cast<int>(i));
    }
    for (std::size_t k = 0; k < order.size(); ++k) {
      const std::vector<int>& children = asset_.nodes[order[k]].children;
      order.insert(order.end(), children.begin(), children.end());
    }
    if (order.size() < asset_.nodes.size()) {
      throw Error(asset_.where_ + "[nodes]", "nodes form a cycle", kExportAgain);
    }
  }

  void Skin(const Entry& entry) {
    GltfSkin skin;
    skin.name = entry.Text("name");
    for (const json& joint : entry.List("joints")) {
      skin.joints.push_back(static_cast<int>(entry.Whole(joint, "joints", Size(asset_.nodes))));
    }
    if (skin.joints.empty()) entry.Fail("joints", "is empty");
    skin.inverse_bind = entry.Index("inverseBindMatrices", Size(asset_.accessors));
    asset_.skins.push_back(std::move(skin));
  }

  void Animation(const Entry& entry) {
    GltfAnimation animation;
    animation.name = entry.Text("name");
    const json& samplers = entry.List("samplers");
    Each(entry, "channels", [&](const Entry& from) {
      const Entry target = from.Inner(from.Need("target"), "target");
      const std::string path = target.Text("path");
      GltfChannel channel;
      channel.node = target.Index("node", Size(asset_.nodes));
      if (path == "translation") {
        channel.path = GltfPath::kTranslation;
      } else if (path == "rotation") {
        channel.path = GltfPath::kRotation;
      } else if (path == "scale") {
        channel.path = GltfPath::kScale;
      } else {
        return;
      }
      if (channel.node < 0) return;
      const auto index = static_cast<std::size_t>(from.RequireIndex("sampler", Size(samplers)));
      const Entry sampler = entry.Inner(samplers[index], "samplers", index);
      channel.input = sampler.RequireIndex("input", Size(asset_.accessors));
      channel.output = sampler.RequireIndex("output", Size(asset_.accessors));
      const std::string interpolation = sampler.Text("interpolation");
      if (interpolation.empty() || interpolation == "LINEAR") {
        channel.interpolation = GltfInterpolation::kLinear;
      } else if (interpolation == "STEP") {
        channel.interpolation = GltfInterpolation::kStep;
      } else if (interpolation == "CUBICSPLINE") {
        channel.interpolation = GltfInterpolation::kCubicSpline;
      } else {
        sampler.Fail("interpolation", "is none of LINEAR, STEP, CUBICSPLINE");
      }
      animation.channels.push_back(channel);
    });
    asset_.animations.push_back(std::move(animation));
  }

  GltfAsset& asset_;
  const std::filesystem::path& folder_;
  std::vector<int> image_of_texture_;  // -1: no readable image
};

GltfAsset GltfAsset::Read(const std::filesystem::path& path) {
  return Parse(ReadGzipText(path), path.string(), path.parent_path());
}

GltfAsset GltfAsset::Parse(std::string bytes, const std::string& where,
                           const std::filesystem::path& folder) {
  GltfAsset asset;
  asset.where_ = where;
  asset.folder_ = folder;
  asset.bytes_.push_back(std::move(bytes));
  GltfParser(asset, folder).Run();
  return asset;
}

std::string GltfAsset::ImageBytes(int image) const {
  const GltfImage& found = images[image];
  const std::string where = fmt::format("{}[images][{}]", where_, image);
  if (found.view < 0) {
    const std::filesystem::path file = ResolveGltfUri(found.uri, folder_, where);
    return file.empty() ? DecodeDataUri(found.uri, where) : ReadFile(file, kMaxImageBytes);
  }
  const GltfBufferView& view = views[found.view];
  const std::string_view bytes = BufferBytes(view.buffer);
  if (view.compressed || view.offset > bytes.size() || view.bytes > bytes.size() - view.offset) {
    throw Error(where, "extends past the end of its buffer", kExportAgain);
  }
  return std::string(bytes.substr(view.offset, view.bytes));
}

std::string GltfAsset::NodeText(int node) const {
  const std::string& name = nodes[node].name;
  return name.empty() ? fmt::format("node {}", node) : fmt::format("'{}' (node {})", name, node);
}

}  // namespace holdfast
