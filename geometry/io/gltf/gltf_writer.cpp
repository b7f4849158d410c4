// SPDX-License-Identifier: MIT
#include "geometry/io/gltf/gltf_writer.h"

#include <algorithm>
#include <array>
#include <vector>

#include "geometry/clip/corrective_basis.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/io/gltf/gltf_builder.h"

namespace holdfast {
namespace {

// Weights dropped from a vertex move it by at most this share of the distance between the places
// where its joints would carry it: well under a hundredth of a millimetre.
constexpr double kNegligibleWeight = 1e-5;

// Each vertex's largest weights first, `sets` times four of them, summing to one.
struct SkinWeights {
  int sets = 1;
  std::vector<std::array<std::uint8_t, 4>> joints;  // set after set, vertex after vertex
  Eigen::Matrix<float, 4, Eigen::Dynamic> weights;
};

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

class GlbWriter {
 public:
  GlbWriter(const Clip& clip, const GlbOptions& options)
      : clip_(clip),
        options_(options),
        gltf_(clip.NumFrames(), clip.frame_rate, options.generator,
              options.clip_name.empty() ? "clip" : options.clip_name) {}

  void AddBody(const BodySurface& surface, GlbReport& report) {
    const CorrectiveBasis basis = WithUnitWeights(ComputeCorrectiveBasis(
        surface, clip_, options_.corrective_tolerance_m,
        options_.correctives ? options_.max_correctives : 0, options_.threads));
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
    gltf_.Model().skins.push_back(std::move(skin));
    return 0;
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

GlbReport WriteGlb(const Clip& clip, const BodySurface& surface, const TriangleMesh* object,
                   const GlbOptions& options, const std::filesystem::path& path) {
  GlbReport report;
  GlbWriter writer(clip, options);
  writer.AddBody(surface, report);
  if (object != nullptr && clip.object) writer.AddObject(*object);
  if (options.table != nullptr && clip.table) writer.AddTable(*options.table);
  writer.AddProvenance(surface);
  WriteAtomically(path, writer.Bytes());
  return report;
}

}  // namespace holdfast
