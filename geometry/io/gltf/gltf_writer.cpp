// SPDX-License-Identifier: MIT
#include "geometry/io/gltf/gltf_writer.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <sstream>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

#include "geometry/clip/clip_arrays.h"
#include "geometry/clip/corrective_basis.h"
#include "geometry/error.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

// Weights dropped from a vertex move it by at most this fraction of the distance between the
// positions to which its joints would carry it: well under a hundredth of a millimeter.
constexpr double kNegligibleWeight = 1e-5;

// Returns the index of the item.
template <typename T>
int PushBack(std::vector<T>& items, T item) {
  items.push_back(std::move(item));
  return static_cast<int>(items.size()) - 1;
}

class GlbWriter {
 public:
  GlbWriter(const Clip& clip, const GlbOptions& options)
      : clip_(clip),
        options_(options),
        gltf_(clip.NumFrames(), clip.frame_rate, options.generator,
              options.clip_name.empty() ? "clip" : options.clip_name) {}

  void AddBody(const BodySurface& surface, SkinReport& report) {
    const CorrectiveBasis basis = WithUnitWeights(
        ComputeCorrectiveBasis(surface, clip_, options_.corrective_tolerance_m,
                               options_.correctives ? kMaxCorrectiveShapes : 0, options_.threads));
    report.morph_targets = static_cast<int>(basis.Size());
    report.corrective_error_m = basis.max_error_m;

    Eigen::Matrix3Xd normals = VertexNormals({surface.RestVertices(), surface.Faces()});
    for (auto normal : normals.colwise()) {
      if (normal.squaredNorm() < 0.5) normal = Eigen::Vector3d::UnitY();
    }
    tinygltf::Mesh mesh;
    mesh.name = "skin";
    mesh.primitives.push_back(
        gltf_.Primitive({basis.rest, surface.Faces()}, normals,
                        gltf_.AddMaterial({"skin", {0.78, 0.60, 0.50, 1}, 0, 0.65, {}}, false)));
    tinygltf::Primitive& primitive = mesh.primitives[0];
    const SkinWeights skin = LargestWeights(surface);
    report.influences = 4 * skin.sets;
    const std::size_t n = surface.NumVertices();
    for (int set = 0; set < skin.sets; ++set) {
      const std::string number = std::to_string(set);
      primitive.attributes["JOINTS_" + number] = gltf_.AddAccessor(
          skin.joints.data() + set * n, 4 * n, n, TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE,
          TINYGLTF_TYPE_VEC4, TINYGLTF_TARGET_ARRAY_BUFFER);
      primitive.attributes["WEIGHTS_" + number] = gltf_.AddFloats(
          skin.weights.middleCols(static_cast<Eigen::Index>(set * n), static_cast<Eigen::Index>(n)),
          TINYGLTF_TYPE_VEC4, TINYGLTF_TARGET_ARRAY_BUFFER);
    }
    AddMorphTargets(basis, mesh);

    tinygltf::Node node;
    node.name = "body";
    node.mesh = gltf_.AddMesh(std::move(mesh));
    const int body = gltf_.AddNode(std::move(node));
    gltf_.Model().nodes[body].skin =
        AddSkin(surface.RestJoints(), AddJoints(body, surface.RestJoints()));
    if (basis.Size() > 0) {
      const Eigen::RowVectorXf weights = basis.coefficients.reshaped().transpose();
      gltf_.Animate(body, "weights", gltf_.AddFloats(weights, TINYGLTF_TYPE_SCALAR));
    }
  }

  void AddObject(const TriangleMesh& object) {
    if (options_.object_look != nullptr) {
      gltf_.AddTracked(*options_.object_look, *clip_.object, "object");
    } else {
      gltf_.AddTracked(PlainMesh(object, ObjectMaterial()), *clip_.object, "object");
    }
  }

  void AddTable(const TriangleMesh& table) {
    gltf_.AddTracked(PlainMesh(table, {"table", {0.42, 0.33, 0.24, 1}, 0, 0.45, {}}), *clip_.table,
                     "table");
  }

  void AddProvenance(const BodySurface& surface) {
    tinygltf::Value::Object extras;
    extras["clip"] = tinygltf::Value(options_.clip_name);
    extras["frames"] = tinygltf::Value(clip_.NumFrames());
    extras["frame_rate"] = tinygltf::Value(clip_.frame_rate);
    extras["body_model"] = tinygltf::Value(surface.Model().Name());
    extras["gender"] = tinygltf::Value(clip_.gender);
    tinygltf::Value::Array betas;
    for (const double beta : clip_.betas) betas.emplace_back(beta);
    extras["betas"] = tinygltf::Value(std::move(betas));
    if (clip_.object) extras["object"] = tinygltf::Value(clip_.object->name);
    gltf_.Model().asset.extras = tinygltf::Value(std::move(extras));
  }

  std::string Bytes() const { return gltf_.Bytes(); }

 private:
  int AddJoints(int body, const Eigen::Matrix3Xd& rest_joints) {
    const auto first = static_cast<int>(gltf_.Model().nodes.size());
    Eigen::Matrix3Xd orient(3, clip_.NumFrames());
    for (int j = 0; j < kNumJoints; ++j) {
      const int parent = kJointParents[j];
      tinygltf::Node node;
      node.name = kJointNames[j];
      if (parent >= 0) {
        node.translation = ToVector((rest_joints.col(j) - rest_joints.col(parent)).eval());
      }
      const int index = gltf_.AddNode(std::move(node), parent < 0 ? body : first + parent);
      for (int t = 0; t < clip_.NumFrames(); ++t) orient.col(t) = clip_.pose[t].col(j);
      if (parent < 0) {
        gltf_.Place(index, clip_.trans.colwise() + rest_joints.col(0), orient);
      } else {
        gltf_.Turn(index, QuaternionsOverTime(Eigen::Matrix3d::Identity(), orient));
      }
    }
    return first;
  }

  int AddSkin(const Eigen::Matrix3Xd& rest_joints, int first_joint) {
    Eigen::Matrix<float, 16, Eigen::Dynamic> inverse_bind(16, kNumJoints);
    tinygltf::Skin skin;
    skin.name = "smplx";
    skin.skeleton = first_joint;
    for (int j = 0; j < kNumJoints; ++j) {
      Eigen::Matrix4f matrix = Eigen::Matrix4f::Identity();
      matrix.topRightCorner<3, 1>() = -rest_joints.col(j).cast<float>();
      inverse_bind.col(j) = matrix.reshaped();
      skin.joints.push_back(first_joint + j);
    }
    skin.inverseBindMatrices = gltf_.AddFloats(inverse_bind, TINYGLTF_TYPE_MAT4);
    return PushBack(gltf_.Model().skins, std::move(skin));
  }

  void AddMorphTargets(const CorrectiveBasis& basis, tinygltf::Mesh& mesh) {
    tinygltf::Value::Array names;
    for (Eigen::Index k = 0; k < basis.Size(); ++k) {
      const Eigen::Matrix3Xf offsets = basis.directions.col(k).reshaped(3, basis.rest.cols());
      mesh.primitives[0].targets.push_back(
          {{"POSITION", gltf_.AddFloats(offsets, TINYGLTF_TYPE_VEC3, TINYGLTF_TARGET_ARRAY_BUFFER,
                                        /*with_range=*/true)}});
      mesh.weights.push_back(basis.coefficients(k, 0));
      names.emplace_back("corrective_" + std::to_string(k));
    }
    if (basis.Size() == 0) return;
    mesh.extras = tinygltf::Value(
        tinygltf::Value::Object{{"targetNames", tinygltf::Value(std::move(names))}});
  }

  const Clip& clip_;
  const GlbOptions& options_;
  GltfBuilder gltf_;
};

}  // namespace

SkinWeights LargestWeights(const BodySurface& surface) {
  const int n = surface.NumVertices();
  std::vector<std::vector<std::pair<int, double>>> sorted(n);
  SkinWeights result;
  for (int v = 0; v < n; ++v) {
    const auto weights = surface.Weights(v);
    sorted[v].assign(weights.begin(), weights.end());
    std::stable_sort(sorted[v].begin(), sorted[v].end(),
                     [](const auto& a, const auto& b) { return a.second > b.second; });
    double dropped = 0;
    for (std::size_t k = 4; k < sorted[v].size(); ++k) dropped += sorted[v][k].second;
    if (dropped > kNegligibleWeight) result.sets = 2;
  }
  result.joints.assign(static_cast<std::size_t>(result.sets) * n, {0, 0, 0, 0});
  result.weights = Eigen::MatrixXf::Zero(4, static_cast<Eigen::Index>(result.sets) * n);
  for (int v = 0; v < n; ++v) {
    const std::size_t kept = std::min<std::size_t>(sorted[v].size(), 4 * result.sets);
    double sum = 0;
    for (std::size_t k = 0; k < kept; ++k) sum += sorted[v][k].second;
    for (std::size_t k = 0; k < kept; ++k) {
      const auto weight = static_cast<float>(sorted[v][k].second / sum);
      if (weight <= 0) continue;  // a joint without weight must be 0
      const std::size_t at = (k / 4) * n + v;
      result.joints[at][k % 4] = static_cast<std::uint8_t>(sorted[v][k].first);
      result.weights(static_cast<Eigen::Index>(k % 4), static_cast<Eigen::Index>(at)) = weight;
    }
  }
  return result;
}

SkinReport WriteGlb(const Clip& clip, const BodySurface& surface, const TriangleMesh* object,
                    const GlbOptions& options, const std::filesystem::path& path) {
  SkinReport report;
  GlbWriter writer(clip, options);
  writer.AddBody(surface, report);
  if (object != nullptr && clip.object) writer.AddObject(*object);
  if (const TriangleMesh* table = TableMesh(clip)) writer.AddTable(*table);
  writer.AddProvenance(surface);
  WriteAtomically(path, writer.Bytes());
  return report;
}

GltfQuaternions ContinuousQuaternions(const std::vector<Eigen::Quaterniond>& rotations) {
  GltfQuaternions result(4, static_cast<Eigen::Index>(rotations.size()));
  Eigen::Quaterniond previous = Eigen::Quaterniond::Identity();
  for (std::size_t t = 0; t < rotations.size(); ++t) {
    Eigen::Quaterniond q = rotations[t].normalized();
    if (q.dot(previous) < 0) q.coeffs() = -q.coeffs();
    result.col(static_cast<Eigen::Index>(t)) = q.coeffs().cast<float>();
    previous = q;
  }
  return result;
}

GltfQuaternions QuaternionsOverTime(const Eigen::Matrix3d& R_after,
                                    const Eigen::Matrix3Xd& axis_angle) {
  std::vector<Eigen::Quaterniond> rotations;
  for (const auto turn : axis_angle.colwise()) rotations.emplace_back(R_after * ExpSO3(turn));
  return ContinuousQuaternions(rotations);
}

Eigen::Matrix3d YUpFromZUp() {
  return (Eigen::Matrix3d() << 1, 0, 0, 0, 0, 1, 0, -1, 0).finished();
}

GltfBuilder::GltfBuilder(int frames, double frame_rate, const std::string& generator,
                         const std::string& animation) {
  model_.asset.version = "2.0";
  model_.asset.generator = generator;
  model_.buffers.emplace_back();
  model_.scenes.emplace_back();
  model_.defaultScene = 0;
  model_.animations.emplace_back().name = animation;
  Eigen::RowVectorXf times(frames);
  for (int t = 0; t < frames; ++t) times(t) = static_cast<float>(t / frame_rate);
  times_ = AddFloats(times, TINYGLTF_TYPE_SCALAR, 0, /*with_range=*/true);
}

int GltfBuilder::AddNode(tinygltf::Node node, int parent) {
  const int index = PushBack(model_.nodes, std::move(node));
  (parent < 0 ? model_.scenes[0].nodes : model_.nodes[parent].children).push_back(index);
  return index;
}

void GltfBuilder::Place(int node, const Eigen::Matrix3Xd& trans, const Eigen::Matrix3Xd& orient) {
  Turn(node, QuaternionsOverTime(YUpFromZUp(), orient));
  Shift(node, (YUpFromZUp() * trans).cast<float>());
}

void GltfBuilder::Turn(int node, const GltfQuaternions& rotation) {
  model_.nodes[node].rotation = ToVector(rotation.col(0));
  Animate(node, "rotation", AddFloats(rotation, TINYGLTF_TYPE_VEC4));
}

void GltfBuilder::Shift(int node, const Eigen::Matrix3Xf& translation) {
  model_.nodes[node].translation = ToVector(translation.col(0));
  Animate(node, "translation", AddFloats(translation, TINYGLTF_TYPE_VEC3));
}

void GltfBuilder::Animate(int node, const char* path, int output) {
  tinygltf::Animation& animation = model_.animations[0];
  tinygltf::AnimationSampler sampler;
  sampler.input = times_;
  sampler.output = output;
  tinygltf::AnimationChannel channel;
  channel.sampler = static_cast<int>(animation.samplers.size());
  channel.target_node = node;
  channel.target_path = path;
  animation.samplers.push_back(std::move(sampler));
  animation.channels.push_back(std::move(channel));
}

void GltfBuilder::AddTracked(const TexturedMesh& rigid, const ObjectTrack& track,
                             const char* usual) {
  tinygltf::Mesh mesh;
  mesh.name = track.name.empty() ? usual : track.name;
  for (const TexturedMesh::Part& part : rigid.parts) {
    const Material& material = rigid.materials[part.material];
    mesh.primitives.push_back(Primitive(part.mesh, part.normals, AddMaterial(material, true)));
    if (part.uv.size() == 0) continue;
    Eigen::Matrix2Xf uv = part.uv.cast<float>();
    uv.row(1) = 1.0f - uv.row(1).array();  // glTF's v points down
    mesh.primitives.back().attributes["TEXCOORD_0"] =
        AddFloats(uv, TINYGLTF_TYPE_VEC2, TINYGLTF_TARGET_ARRAY_BUFFER);
  }
  tinygltf::Node node;
  node.name = mesh.name;
  node.mesh = AddMesh(std::move(mesh));
  Place(AddNode(std::move(node)), track.trans, track.orient);
}

int GltfBuilder::AddMesh(tinygltf::Mesh mesh) { return PushBack(model_.meshes, std::move(mesh)); }

int GltfBuilder::AddMaterial(const Material& look, bool double_sided) {
  tinygltf::Material material;
  material.name = look.name;
  tinygltf::PbrMetallicRoughness& pbr = material.pbrMetallicRoughness;
  pbr.baseColorFactor = ToVector(look.color);
  pbr.metallicFactor = look.metallic;
  pbr.roughnessFactor = look.roughness;
  if (look.color[3] < 1) material.alphaMode = "BLEND";
  if (!look.image.empty()) pbr.baseColorTexture.index = AddTexture(look.image);
  material.doubleSided = double_sided;  // objects may be open sheets
  return PushBack(model_.materials, std::move(material));
}

// Adds a PNG or JPEG file as a texture, once for all materials that share it.
int GltfBuilder::AddTexture(const std::string& file) {
  const auto [at, is_new] = texture_of_.try_emplace(file, static_cast<int>(model_.textures.size()));
  if (!is_new) return at->second;
  tinygltf::Image image;
  image.mimeType = file[0] == '\x89' ? "image/png" : "image/jpeg";
  image.bufferView = AddView(file.data(), file.size(), 0);
  tinygltf::Texture texture;
  texture.source = PushBack(model_.images, std::move(image));
  model_.textures.push_back(std::move(texture));
  return at->second;
}

tinygltf::Primitive GltfBuilder::Primitive(const TriangleMesh& mesh,
                                           const Eigen::Matrix3Xd& normals, int material) {
  tinygltf::Primitive primitive;
  primitive.mode = TINYGLTF_MODE_TRIANGLES;
  primitive.material = material;
  primitive.attributes["POSITION"] =
      AddFloats(mesh.vertices.cast<float>(), TINYGLTF_TYPE_VEC3, TINYGLTF_TARGET_ARRAY_BUFFER,
                /*with_range=*/true);
  primitive.attributes["NORMAL"] =
      AddFloats(normals.cast<float>(), TINYGLTF_TYPE_VEC3, TINYGLTF_TARGET_ARRAY_BUFFER);
  const auto count = static_cast<std::size_t>(mesh.faces.size());
  // The largest 16-bit index is reserved for primitive restart.
  if (mesh.NumVertices() < 65535) {
    const Eigen::Matrix<std::uint16_t, 3, Eigen::Dynamic> faces = mesh.faces.cast<std::uint16_t>();
    primitive.indices =
        AddAccessor(faces.data(), 2 * count, count, TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT,
                    TINYGLTF_TYPE_SCALAR, TINYGLTF_TARGET_ELEMENT_ARRAY_BUFFER);
  } else {
    primitive.indices =
        AddAccessor(mesh.faces.data(), 4 * count, count, TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT,
                    TINYGLTF_TYPE_SCALAR, TINYGLTF_TARGET_ELEMENT_ARRAY_BUFFER);
  }
  return primitive;
}

int GltfBuilder::AddFloats(const Eigen::MatrixXf& columns, int type, int target, bool with_range) {
  const int index = AddAccessor(columns.data(), 4 * static_cast<std::size_t>(columns.size()),
                                static_cast<std::size_t>(columns.cols()),
                                TINYGLTF_COMPONENT_TYPE_FLOAT, type, target);
  if (with_range) {
    model_.accessors[index].minValues = ToVector(columns.rowwise().minCoeff().eval());
    model_.accessors[index].maxValues = ToVector(columns.rowwise().maxCoeff().eval());
  }
  return index;
}

int GltfBuilder::AddView(const void* data, std::size_t num_bytes, int target) {
  std::vector<unsigned char>& bytes = model_.buffers[0].data;
  bytes.resize((bytes.size() + 3) / 4 * 4);
  tinygltf::BufferView view;
  view.buffer = 0;
  view.byteOffset = bytes.size();
  view.byteLength = num_bytes;
  view.target = target;
  const auto* begin = static_cast<const unsigned char*>(data);
  bytes.insert(bytes.end(), begin, begin + num_bytes);
  return PushBack(model_.bufferViews, std::move(view));
}

int GltfBuilder::AddAccessor(const void* data, std::size_t num_bytes, std::size_t count,
                             int component, int type, int target) {
  tinygltf::Accessor accessor;
  accessor.bufferView = AddView(data, num_bytes, target);
  accessor.componentType = component;
  accessor.type = type;
  accessor.count = count;
  return PushBack(model_.accessors, std::move(accessor));
}

std::string GltfBuilder::Bytes() const {
  if (model_.buffers[0].data.size() > kMaxGltfBytes) {
    throw Error("the clip", "makes a glTF of more than 4 GB, which the format cannot hold",
                "Export a part of it");
  }
  std::ostringstream stream;
  tinygltf::TinyGLTF writer;
  writer.WriteGltfSceneToStream(&model_, stream, /*prettyPrint=*/false, /*writeBinary=*/true);
  return std::move(stream).str();
}

}  // namespace holdfast
