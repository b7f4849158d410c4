// SPDX-License-Identifier: MIT
#include "geometry/io/gltf/gltf_builder.h"

#include <cstring>
#include <limits>
#include <sstream>

#include <Eigen/Geometry>

#include "geometry/error.h"
#include "geometry/rotation.h"

namespace holdfast {
GltfQuaternions QuaternionsOverTime(const Eigen::Matrix3d& R_after,
                                    const Eigen::Matrix3Xd& axis_angle) {
  GltfQuaternions result(4, axis_angle.cols());
  Eigen::Quaterniond previous = Eigen::Quaterniond::Identity();
  for (Eigen::Index t = 0; t < axis_angle.cols(); ++t) {
    Eigen::Quaterniond q(R_after * ExpSO3(axis_angle.col(t)));
    q.normalize();
    if (q.dot(previous) < 0) q.coeffs() = -q.coeffs();
    result.col(t) = q.coeffs().cast<float>();
    previous = q;
  }
  return result;
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
  const auto index = static_cast<int>(model_.nodes.size());
  model_.nodes.push_back(std::move(node));
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
    const Material& material = rigid.materials[static_cast<std::size_t>(part.material)];
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

int GltfBuilder::AddMesh(tinygltf::Mesh mesh) {
  model_.meshes.push_back(std::move(mesh));
  return static_cast<int>(model_.meshes.size()) - 1;
}

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
  model_.materials.push_back(std::move(material));
  return static_cast<int>(model_.materials.size()) - 1;
}

// Of a PNG or JPEG file, once for all materials that share it.
int GltfBuilder::AddTexture(const std::string& file) {
  const auto [at, is_new] = texture_of_.try_emplace(file, static_cast<int>(model_.textures.size()));
  if (!is_new) return at->second;
  tinygltf::Image image;
  image.mimeType = file[0] == '\x89' ? "image/png" : "image/jpeg";
  image.bufferView = AddView(file.data(), file.size(), 0);
  tinygltf::Texture texture;
  texture.source = static_cast<int>(model_.images.size());
  model_.images.push_back(std::move(image));
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
  // The largest 16-bit index is kept for restarting primitives.
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

int GltfBuilder::AddFloatMatrix(const Eigen::MatrixXf& values, int type, int target,
                                bool with_range) {
  const int index = AddAccessor(values.data(), 4 * static_cast<std::size_t>(values.size()),
                                static_cast<std::size_t>(values.cols()),
                                TINYGLTF_COMPONENT_TYPE_FLOAT, type, target);
  if (with_range) {
    model_.accessors[index].minValues = ToVector(values.rowwise().minCoeff().eval());
    model_.accessors[index].maxValues = ToVector(values.rowwise().maxCoeff().eval());
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
  model_.bufferViews.push_back(std::move(view));
  return static_cast<int>(model_.bufferViews.size()) - 1;
}

int GltfBuilder::AddAccessor(const void* data, std::size_t num_bytes, std::size_t count,
                             int component, int type, int target) {
  tinygltf::Accessor accessor;
  accessor.bufferView = AddView(data, num_bytes, target);
  accessor.componentType = component;
  accessor.type = type;
  accessor.count = count;
  model_.accessors.push_back(std::move(accessor));
  return static_cast<int>(model_.accessors.size()) - 1;
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
