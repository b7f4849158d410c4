// SPDX-License-Identifier: MIT
// A clip, out in every format that can be read again, and back: to the precision of the format.
#include <cmath>
#include <cstdlib>
#include <random>
#include <sstream>
#include <tuple>

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "geometry/body/body_model.h"
#include "geometry/clip/clip.h"
#include "geometry/clip/clip_arrays.h"
#include "geometry/import/import_file.h"
#include "geometry/import/import_motion.h"
#include "geometry/io/gltf/gltf_writer.h"
#include "geometry/io/mesh/mesh_io.h"
#include "geometry/io/motion/bvh.h"
#include "geometry/io/motion/motion_file.h"
#include "geometry/rotation.h"
#include "tests/support/moving_clip.h"
#include "tests/support/temporary_folder.h"

namespace holdfast {
namespace {

using testing::TemporaryFolder;

// Any pose a body may be in, each frame on its own: rapidcheck draws the length, the rate, the seed
// and whether there is an object, and makes them small again when something fails.
Clip AnyClip(bool with_object) {
  const int frames = *rc::gen::inRange(1, 41);
  std::mt19937_64 random(*rc::gen::arbitrary<unsigned>());
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto vector = [&](double size) -> Eigen::Vector3d {
    return size * Eigen::Vector3d(uniform(random), uniform(random), uniform(random));
  };
  Clip clip;
  clip.frame_rate = *rc::gen::inRange(501, 24000) / 100.0;  // 29.97, 59.94, 133.37, ...
  clip.trans.resize(3, frames);
  clip.pose.resize(static_cast<std::size_t>(frames));
  for (int t = 0; t < frames; ++t) {
    JointPose& pose = clip.pose[static_cast<std::size_t>(t)];
    for (int j = 0; j < kNumJoints; ++j) pose.col(j) = vector(1.2);
    pose.col(0) = vector(1.8);
    clip.trans.col(t) = vector(3);
  }
  clip.betas.resize(*rc::gen::inRange(0, 11));
  for (double& beta : clip.betas) beta = 2 * uniform(random);
  clip.gender = *rc::gen::element<std::string>("neutral", "female", "male");
  if (with_object && *rc::gen::arbitrary<bool>()) {
    ObjectTrack track;
    track.name = "mug";
    track.trans.resize(3, frames);
    track.orient.resize(3, frames);
    for (int t = 0; t < frames; ++t) {
      track.trans.col(t) = vector(2);
      track.orient.col(t) = vector(1.8);
    }
    clip.object = track;
    for (int t = 0; t < frames; ++t) {
      clip.holding_hand.push_back(static_cast<std::uint8_t>(random() % 4));
    }
  }
  return clip;
}

// The largest differences between two clips: rotations as angles, so that w and w + 2 pi agree.
struct Drift {
  double rotation = 0;  // radians
  double place = 0;     // meters
};

void AddTrack(const Eigen::Matrix3Xd& trans_a, const Eigen::Matrix3Xd& orient_a,
              const Eigen::Matrix3Xd& trans_b, const Eigen::Matrix3Xd& orient_b, Drift& most) {
  for (Eigen::Index t = 0; t < trans_a.cols(); ++t) {
    most.place = std::max(most.place, (trans_a.col(t) - trans_b.col(t)).norm());
    most.rotation =
        std::max(most.rotation, AngleBetween(ExpSO3(orient_a.col(t)), ExpSO3(orient_b.col(t))));
  }
}

Drift Between(const Clip& a, const Clip& b) {
  Drift most;
  for (int j = 0; j < kNumJoints; ++j) {
    Eigen::Matrix3Xd of_a(3, a.NumFrames()), of_b(3, a.NumFrames());
    for (int t = 0; t < a.NumFrames(); ++t) {
      of_a.col(t) = a.pose[static_cast<std::size_t>(t)].col(j);
      of_b.col(t) = b.pose[static_cast<std::size_t>(t)].col(j);
    }
    AddTrack(a.trans, of_a, b.trans, of_b, most);
  }
  if (a.object && b.object) {
    AddTrack(a.object->trans, a.object->orient, b.object->trans, b.object->orient, most);
  }
  return most;
}

RetargetBody BodyOf(const BodySurface& surface) {
  RetargetBody body;
  body.rest_joints = surface.RestJoints();
  body.floor_y = surface.RestVertices().row(1).minCoeff();
  return body;
}

ImportOptions AsTheFileHasIt() {
  ImportOptions options;
  options.keep_ground = true;
  options.frame_rate = 0;
  options.up = UpAxis::kY;  // random poses have no posture to judge by
  return options;
}

class Worst {
 public:
  explicit Worst(std::string name) : name_(std::move(name)) {}
  ~Worst() {
    // For the table of what comes back how exactly; --gtest_output=xml shows it.
    ::testing::Test::RecordProperty(name_ + "_rad", std::to_string(1e9 * most_.rotation) + "e-9");
    ::testing::Test::RecordProperty(name_ + "_m", std::to_string(1e9 * most_.place) + "e-9");
  }
  void Add(const Drift& difference) {
    most_.rotation = std::max(most_.rotation, difference.rotation);
    most_.place = std::max(most_.place, difference.place);
  }

 private:
  std::string name_;
  Drift most_;
};

// The same clips in every run, but for RC_PARAMS.
template <typename Property>
void Check(const std::string& what, int runs, const Property& property) {
  rc::detail::TestParams params = rc::detail::configuration().testParams;
  if (std::getenv("RC_PARAMS") == nullptr) {
    params.maxSuccess = runs;
    params.seed = 5;
  }
  const auto result =
      rc::detail::checkTestable(property, rc::detail::TestMetadata{what, what}, params);
  std::ostringstream text;
  rc::detail::printResultMessage(result, text);
  EXPECT_TRUE(result.template is<rc::detail::SuccessResult>()) << text.str();
}

TEST(RoundTrip, NpzKeepsEveryBit) {
  const TemporaryFolder folder;
  Check("npz", 100, [&] {
    Clip clip = AnyClip(true);
    clip.body_model = "holdfast_neutral";
    if (clip.object) clip.object->mesh = "object.ply";
    WriteClip(clip, folder / "a.npz");
    const Clip back = ReadClip(folder / "a.npz");
    RC_ASSERT(back.body_model == clip.body_model);
    RC_ASSERT(back.frame_rate == clip.frame_rate);
    RC_ASSERT(back.trans == clip.trans);
    RC_ASSERT(back.pose == clip.pose);
    RC_ASSERT(back.betas == WrittenBetas(clip));
    RC_ASSERT(back.gender == clip.gender);
    RC_ASSERT(back.holding_hand == clip.holding_hand);
    RC_ASSERT(back.object.has_value() == clip.object.has_value());
    if (clip.object) {
      RC_ASSERT(back.object->trans == clip.object->trans);
      RC_ASSERT(back.object->orient == clip.object->orient);
      RC_ASSERT(back.object->name == clip.object->name);
      RC_ASSERT(back.object->mesh == clip.object->mesh);
    }
  });
}

// Single precision: 6e-8 of a quaternion's part is 3e-7 radians at worst, and places lie within
// a few meters. The file tells the betas, so that the body is the same.
TEST(RoundTrip, GlbKeepsSinglePrecision) {
  const TemporaryFolder folder;
  const auto model = BodyModel::Default();
  const TriangleMesh object = testing::Tetrahedron();
  Worst worst("glb");
  Check("glb", 40, [&] {
    const Clip clip = AnyClip(true);
    GlbOptions options;
    options.correctives = false;
    WriteGlb(clip, BodySurface(model, clip.betas), &object, options, folder / "a.glb");

    const SourceMotion motion = ReadMotion(folder / "a.glb");
    RC_ASSERT(motion.betas == clip.betas);
    ImportReport report;
    ImportOptions import = AsTheFileHasIt();
    import.betas = motion.betas;
    const Clip back =
        ImportMotion(motion, "a.glb", BodyOf(BodySurface(model, motion.betas)), import, &report);
    RC_ASSERT(report.retarget.same_skeleton);
    RC_ASSERT(report.mapped_joints == kNumJoints);
    RC_ASSERT(back.NumFrames() == clip.NumFrames());
    RC_ASSERT(back.frame_rate == clip.frame_rate);
    RC_ASSERT(back.gender == clip.gender);
    RC_ASSERT(back.betas == clip.betas);
    RC_ASSERT(back.object.has_value() == clip.object.has_value());
    if (clip.object) {
      RC_ASSERT(back.object->name == "mug");
      RC_ASSERT(motion.prop->mesh.NumVertices() == 4);
    }
    const Drift difference = Between(clip, back);
    worst.Add(difference);
    RC_ASSERT(difference.rotation < 4e-7);
    RC_ASSERT(difference.place < 6e-7);
  });
}

// A motion with what a family of models has and nothing else: SMPL-H no face, MANO no body.
Clip Only(Clip clip, ModelKind kind) {
  clip.object.reset();
  clip.holding_hand.clear();
  for (JointPose& pose : clip.pose) {
    if (kind != ModelKind::kSmplx) pose.middleCols(22, 3).setZero();
    if (const std::optional<Side> hand = LoneHand(kind)) {
      const int begin = HandBegin(*hand);
      JointPose alone = JointPose::Zero();
      alone.col(0) = pose.col(0);
      alone.middleCols(begin, kJointsPerHand) = pose.middleCols(begin, kJointsPerHand);
      pose = alone;
    }
  }
  if (LoneHand(kind)) clip.surface_model_type = "mano";
  if (kind == ModelKind::kSmplh) clip.surface_model_type = "smplh";
  return clip;
}

// Double precision in every layout and container, by import's own reading of them.
TEST(RoundTrip, ParametersKeepEveryNumber) {
  const TemporaryFolder folder;
  ImportFileOptions import;
  import.parameters.body = BodyModel::Default();
  import.parameters.up = UpAxis::kZ;
  import.parameters.keep_ground = true;
  import.frame_rate = 0;
  using enum ParameterLayout;
  for (const auto& [kind, layout, name] : {std::tuple{ModelKind::kSmplx, kPackage, "a.npz"},
                                           {ModelKind::kSmplx, kPackage, "a.json"},
                                           std::tuple{ModelKind::kSmplx, kAmass, "a.npz"},
                                           {ModelKind::kSmplh, kPackage, "a.npz"},
                                           std::tuple{ModelKind::kSmplh, kPackage, "a.json"},
                                           {ModelKind::kSmplh, kAmass, "a.npz"},
                                           std::tuple{ModelKind::kManoRight, kPackage, "a.json"}}) {
    const std::string what = std::string(ModelKindName(kind)) + (layout == kAmass ? " " : " p ");
    Check(what + name, 10, [&, kind = kind, layout = layout, name = name] {
      const Clip clip = Only(AnyClip(false), kind);
      WriteParameters(clip, kind, layout, true, folder / name);
      const ImportedFile back = ImportFile(folder / name, import);
      RC_ASSERT(back.clip.NumFrames() == clip.NumFrames());
      RC_ASSERT(back.clip.frame_rate == clip.frame_rate);
      RC_ASSERT(back.clip.gender == clip.gender);
      RC_ASSERT(back.clip.betas == WrittenBetas(clip));
      const Drift difference = Between(clip, back.clip);
      RC_ASSERT(difference.rotation < 1e-12);
      RC_ASSERT(difference.place < 1e-12);
    });
  }
}

// Six decimals of a degree and of a centimeter, rotations relative to parents.
TEST(RoundTrip, BvhKeepsSixDecimals) {
  const TemporaryFolder folder;
  const auto model = BodyModel::Default();
  Worst worst("bvh");
  Check("bvh", 40, [&] {
    const Clip clip = AnyClip(false);
    const BodySurface surface(model, clip.betas);
    WriteBvh(clip, surface, folder / "a.bvh");
    ImportReport report;
    const Clip back = ImportMotion(folder / "a.bvh", BodyOf(surface), AsTheFileHasIt(), &report);
    RC_ASSERT(report.retarget.same_skeleton);
    RC_ASSERT(back.NumFrames() == clip.NumFrames());
    // Rates near a whole number are taken for it, as the format's rounded frame times want.
    RC_ASSERT(std::abs(back.frame_rate - clip.frame_rate) < 2e-3 * clip.frame_rate);
    const Drift difference = Between(clip, back);
    worst.Add(difference);
    RC_ASSERT(difference.rotation < 1e-7);
    RC_ASSERT(difference.place < 2e-7);
  });
}

// A soup of triangles that uses each vertex, none of them in the same place as another.
TriangleMesh AnyMesh() {
  const int vertices = *rc::gen::inRange(3, 60);
  std::mt19937_64 random(*rc::gen::arbitrary<unsigned>());
  const double size = std::pow(10.0, *rc::gen::inRange(-3, 3));
  std::uniform_real_distribution<double> uniform(-size, size);
  TriangleMesh mesh;
  mesh.vertices.resize(3, vertices);
  for (double& x : mesh.vertices.reshaped()) x = uniform(random);
  mesh.faces.resize(3, vertices - 2);
  for (int f = 0; f < vertices - 2; ++f) mesh.faces.col(f) << f, f + 1, f + 2;
  return mesh;
}

TEST(RoundTrip, MeshesKeepSinglePrecision) {
  const TemporaryFolder folder;
  Check("meshes", 100, [&] {
    const TriangleMesh mesh = AnyMesh();
    const Eigen::Matrix3Xd single = mesh.vertices.cast<float>().cast<double>();
    const double size = mesh.vertices.cwiseAbs().maxCoeff();
    for (const char* name : {"a.ply", "a.stl", "a.obj", "a.off"}) {
      WriteMesh(mesh, folder / name);
      const TriangleMesh back = ReadMesh(folder / name);
      RC_ASSERT(back.faces.cols() == mesh.faces.cols());
      const bool text = std::string(name).ends_with("obj") || std::string(name).ends_with("off");
      for (Eigen::Index f = 0; f < mesh.faces.cols(); ++f) {
        for (int k = 0; k < 3; ++k) {
          const Eigen::Vector3d before = single.col(mesh.faces(k, f));
          const Eigen::Vector3d after = back.vertices.col(back.faces(k, f));
          // Binary formats keep the single itself, texts enough digits of it.
          RC_ASSERT((after - before).cwiseAbs().maxCoeff() <= (text ? 1e-6 * size : 0.0));
        }
      }
      if (std::string(name) != "a.stl") RC_ASSERT(back.faces == mesh.faces);
    }
  });
}

}  // namespace
}  // namespace holdfast
