// SPDX-License-Identifier: MIT
#include <iterator>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "geometry/clip/clip_arrays.h"
#include "geometry/clip/corrective_basis.h"
#include "geometry/clip/resample.h"
#include "geometry/export/export_clip.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

constexpr double kNegligibleOffset_m = 1e-6;

// A USD string literal.
std::string Quoted(const std::string& text) {
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') result += '\\';
    result += c == '\n' || c == '\r' ? ' ' : c;
  }
  return result + '"';
}

// "(x, y, z), (x, y, z)" of columns, a hundredth of a millimeter and finer.
std::string Columns(const Eigen::Matrix3Xd& points,
                    const char* format = "({:.5f}, {:.5f}, {:.5f})") {
  std::string text;
  for (Eigen::Index v = 0; v < points.cols(); ++v) {
    if (v > 0) text += ", ";
    fmt::format_to(std::back_inserter(text), fmt::runtime(format), points(0, v), points(1, v),
                   points(2, v));
  }
  return text;
}

// A matrix for row vectors, x_parent = x M.
std::string Matrix(const Eigen::Isometry3d& pose) {
  const Eigen::Matrix3d M = pose.linear().transpose();
  const Eigen::Vector3d T = pose.translation();
  return fmt::format(
      "( ({:.9f}, {:.9f}, {:.9f}, 0), ({:.9f}, {:.9f}, {:.9f}, 0), ({:.9f}, {:.9f}, {:.9f}, 0), "
      "({:.6f}, {:.6f}, {:.6f}, 1) )",
      M(0, 0), M(0, 1), M(0, 2), M(1, 0), M(1, 1), M(1, 2), M(2, 0), M(2, 1), M(2, 2), T.x(), T.y(),
      T.z());
}

// Lines of a stage, indented by depth.
class Stage {
 public:
  void Line(const std::string& line) { text_.append(4 * depth_, ' ').append(line).append("\n"); }
  // `type "name"`, with `metadata` in parentheses if any.
  void Open(const std::string& head, const std::string& metadata = "") {
    Line("def " + head +
         (metadata.empty() ? ""
                           : " (\n" + std::string(4 * depth_ + 4, ' ') + metadata + "\n" +
                                 std::string(4 * depth_, ' ') + ")"));
    Line("{");
    ++depth_;
  }
  void Close() {
    --depth_;
    Line("}");
  }
  // One value for each of the frames, at its number.
  template <typename Value>
  void Samples(const std::string& attribute, const std::vector<int>& frames, const Value& value) {
    Line(attribute + ".timeSamples = {");
    for (const int t : frames) Line(fmt::format("    {}: {},", t, value(t)));
    Line("}");
  }
  void Mesh(const TriangleMesh& mesh, const std::string& color) {
    std::string counts;
    for (int f = 0; f < mesh.NumFaces(); ++f) counts += f == 0 ? "3" : ", 3";
    Line("int[] faceVertexCounts = [" + counts + "]");
    Line(fmt::format("int[] faceVertexIndices = [{}]",
                     fmt::join(mesh.faces.data(), mesh.faces.data() + mesh.faces.size(), ", ")));
    Line("point3f[] points = [" + Columns(mesh.vertices) + "]");
    Eigen::Matrix3Xd box(3, 2);
    box << mesh.vertices.rowwise().minCoeff(), mesh.vertices.rowwise().maxCoeff();
    Line("float3[] extent = [" + Columns(box) + "]");
    Line("color3f[] primvars:displayColor = [" + color + "] (");
    Line("    interpolation = \"constant\"");
    Line(")");
    Line("uniform token subdivisionScheme = \"none\"");
  }
  void Tracked(const char* name, const TriangleMesh& mesh, const ObjectTrack& track,
               const std::string& color, const std::vector<int>& frames) {
    Open(fmt::format("Mesh \"{}\"", name));
    Line("uniform bool doubleSided = 1");  // objects may be open sheets
    Mesh(mesh, color);
    Samples("matrix4d xformOp:transform", frames, [&](int t) { return Matrix(track.Pose(t)); });
    Line("uniform token[] xformOpOrder = [\"xformOp:transform\"]");
    Close();
  }

  std::string Text() && { return std::move(text_); }

 private:
  std::string text_;
  std::size_t depth_ = 0;
};

std::string JointPaths() {
  std::vector<std::string> paths;
  for (int j = 0; j < kNumJoints; ++j) {
    const std::string name(kJointNames[j]);
    paths.push_back(kJointParents[j] < 0 ? name : paths[kJointParents[j]] + "/" + name);
  }
  std::string text;
  for (const std::string& path : paths) text += (text.empty() ? "" : ", ") + Quoted(path);
  return "[" + text + "]";
}

// Translation of each joint in its parent's frame; the pelvis is at `root`.
Eigen::Matrix3Xd Offsets(const Eigen::Matrix3Xd& rest_joints, const Eigen::Vector3d& root) {
  Eigen::Matrix3Xd offsets = rest_joints;
  for (int j = 1; j < kNumJoints; ++j) offsets.col(j) -= rest_joints.col(kJointParents[j]);
  offsets.col(0) = root;
  return offsets;
}

std::string Translations(const Eigen::Matrix3Xd& offsets, bool in_world) {
  std::string text;
  for (int j = 0; j < kNumJoints; ++j) {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    for (int k = j; k >= 0; k = in_world ? kJointParents[k] : -1) {
      pose.translation() += offsets.col(k);
    }
    text += (j == 0 ? "" : ", ") + Matrix(pose);
  }
  return "[" + text + "]";
}

void WriteSkeleton(const Clip& clip, const Eigen::Matrix3Xd& rest_joints,
                   const CorrectiveBasis& basis, const std::string& shapes,
                   const std::vector<int>& frames, Stage& stage) {
  const std::string joints = "uniform token[] joints = " + JointPaths();
  const Eigen::Matrix3Xd rest = Offsets(rest_joints, rest_joints.col(0));
  stage.Open("Skeleton \"skeleton\"", "prepend apiSchemas = [\"SkelBindingAPI\"]");
  stage.Line(joints);
  stage.Line("uniform matrix4d[] bindTransforms = " + Translations(rest, true));
  stage.Line("uniform matrix4d[] restTransforms = " + Translations(rest, false));
  stage.Line("rel skel:animationSource = </World/body/skeleton/motion>");
  stage.Open("SkelAnimation \"motion\"");
  stage.Line(joints);
  stage.Samples("float3[] translations", frames, [&](int t) {
    const Eigen::Matrix3Xd offsets = Offsets(rest_joints, rest_joints.col(0) + clip.trans.col(t));
    return "[" + Columns(offsets, "({:.7g}, {:.7g}, {:.7g})") + "]";
  });
  stage.Samples("quatf[] rotations", frames, [&](int t) {
    std::string text = "[";
    for (int j = 0; j < kNumJoints; ++j) {
      Eigen::Quaterniond q(ExpSO3(Eigen::Vector3d(clip.pose[t].col(j))));
      if (q.w() < 0) q.coeffs() = -q.coeffs();
      text += fmt::format("{}({:.7g}, {:.7g}, {:.7g}, {:.7g})", j == 0 ? "" : ", ", q.w(), q.x(),
                          q.y(), q.z());
    }
    return text + "]";
  });
  std::string scales;
  for (int j = 0; j < kNumJoints; ++j) scales += j == 0 ? "(1, 1, 1)" : ", (1, 1, 1)";
  stage.Line("half3[] scales = [" + scales + "]");
  if (basis.Size() > 0) {
    stage.Line("uniform token[] blendShapes = " + shapes);
    stage.Samples("float[] blendShapeWeights", frames, [&](int t) {
      const Eigen::VectorXf weights = basis.coefficients.col(t);
      return fmt::format("[{:.6g}]",
                         fmt::join(weights.data(), weights.data() + weights.size(), ", "));
    });
  }
  stage.Close();
  stage.Close();
}

void WriteBlendShape(const std::string& name, const Eigen::Matrix3Xd& offsets, Stage& stage) {
  std::vector<int> moved;
  for (Eigen::Index v = 0; v < offsets.cols(); ++v) {
    if (offsets.col(v).cwiseAbs().maxCoeff() > kNegligibleOffset_m) {
      moved.push_back(static_cast<int>(v));
    }
  }
  stage.Open("BlendShape \"" + name + "\"");
  stage.Line("uniform vector3f[] offsets = [" +
             Columns(offsets(Eigen::all, moved), "({:.4g}, {:.4g}, {:.4g})") + "]");
  stage.Line(fmt::format("uniform int[] pointIndices = [{}]", fmt::join(moved, ", ")));
  stage.Close();
}

SkinReport WriteBody(const Clip& clip, const BodySurface& surface, const ExportOptions& options,
                     const std::vector<int>& frames, Stage& stage) {
  const CorrectiveBasis basis = WithUnitWeights(
      ComputeCorrectiveBasis(surface, clip, options.tolerance_m,
                             options.correctives ? kMaxCorrectiveShapes : 0, options.threads));
  const SkinWeights skin = LargestWeights(surface);
  std::string shapes, targets;
  for (Eigen::Index k = 0; k < basis.Size(); ++k) {
    shapes += fmt::format("{}\"corrective_{}\"", k == 0 ? "" : ", ", k);
    targets += fmt::format("{}</World/body/skin/corrective_{}>", k == 0 ? "" : ", ", k);
  }
  shapes = "[" + shapes + "]";
  stage.Open("SkelRoot \"body\"");
  WriteSkeleton(clip, surface.RestJoints(), basis, shapes, frames, stage);

  stage.Open("Mesh \"skin\"", "prepend apiSchemas = [\"SkelBindingAPI\"]");
  stage.Mesh({basis.rest, surface.Faces()}, "(0.78, 0.6, 0.5)");
  const auto n = static_cast<std::size_t>(surface.NumVertices());
  std::string joints, weights;
  for (std::size_t v = 0; v < n; ++v) {
    for (int set = 0; set < skin.sets; ++set) {
      const std::size_t at = static_cast<std::size_t>(set) * n + v;
      for (std::size_t k = 0; k < 4; ++k) {
        const char* separator = joints.empty() ? "" : ", ";
        joints += fmt::format("{}{}", separator, skin.joints[at][k]);
        weights +=
            fmt::format("{}{:.6g}", separator,
                        skin.weights(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(at)));
      }
    }
  }
  for (const auto& [head, values] : {std::pair{"int[] primvars:skel:jointIndices", &joints},
                                     std::pair{"float[] primvars:skel:jointWeights", &weights}}) {
    stage.Line(fmt::format("{} = [{}] (", head, *values));
    stage.Line(fmt::format("    elementSize = {}", 4 * skin.sets));
    stage.Line("    interpolation = \"vertex\"");
    stage.Line(")");
  }
  stage.Line("matrix4d primvars:skel:geomBindTransform = " + Matrix(Eigen::Isometry3d::Identity()));
  stage.Line("rel skel:skeleton = </World/body/skeleton>");
  if (basis.Size() > 0) {
    stage.Line("uniform token[] skel:blendShapes = " + shapes);
    stage.Line("rel skel:blendShapeTargets = [" + targets + "]");
    for (Eigen::Index k = 0; k < basis.Size(); ++k) {
      const Eigen::Matrix3Xf offsets = basis.directions.col(k).reshaped(3, basis.rest.cols());
      WriteBlendShape(fmt::format("corrective_{}", k), offsets.cast<double>(), stage);
    }
  }
  stage.Close();
  stage.Close();
  return {static_cast<int>(basis.Size()), 4 * skin.sets, basis.max_error_m};
}

}  // namespace

SkinReport WriteUsda(const Clip& clip, const BodySurface& surface, const TriangleMesh* object,
                     const ExportOptions& options, const std::filesystem::path& path) {
  const std::vector<int> frames = EveryFrame(clip.NumFrames(), options.every);
  Stage stage;
  stage.Line("#usda 1.0");
  stage.Line("(");
  for (const std::string& line :
       {std::string("defaultPrim = \"World\""), "doc = " + Quoted("Made by " + options.generator),
        fmt::format("endTimeCode = {}", clip.NumFrames() - 1),
        fmt::format("framesPerSecond = {:.9g}", clip.frame_rate), std::string("metersPerUnit = 1"),
        std::string("startTimeCode = 0"),
        fmt::format("timeCodesPerSecond = {:.9g}", clip.frame_rate),
        std::string("upAxis = \"Z\"")}) {
    stage.Line("    " + line);
  }
  stage.Line(")");
  stage.Open("Xform \"World\"");
  const SkinReport report = WriteBody(clip, surface, options, frames, stage);
  if (object != nullptr && clip.object) {
    stage.Tracked("object", *object, *clip.object, "(0.16, 0.38, 0.62)", frames);
  }
  if (const TriangleMesh* table = TableMesh(clip)) {
    stage.Tracked("table", *table, *clip.table, "(0.42, 0.33, 0.24)", frames);
  }
  stage.Close();
  WriteAtomically(path, std::move(stage).Text());
  return report;
}

}  // namespace holdfast
