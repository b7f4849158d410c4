// SPDX-License-Identifier: MIT
#include "geometry/export/export_clip.h"

#include <cctype>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "geometry/io/container/atomic_file.h"
#include "tests/support/moving_clip.h"
#include "tests/support/temporary_folder.h"

namespace holdfast {
namespace {

using testing::MakeMovingClip;
using testing::TemporaryFolder;
using testing::Tetrahedron;

// A strict reader of the part of USD's text format that meshes and transforms need. Every attribute
// by its path ("/World/body.points"); numbers of arrays and tuples in one row, times as keys.
class UsdaReader {
 public:
  struct Attribute {
    std::string type;
    bool uniform = false;
    std::vector<double> numbers;
    std::vector<std::string> words;
    std::map<double, std::vector<double>> samples;
  };

  explicit UsdaReader(std::string text) : text_(std::move(text)) {
    if (text_.compare(0, 10, "#usda 1.0\n") != 0) throw std::runtime_error("no header");
    at_ = 10;
    Expect("(");
    while (!Try(")")) {
      const std::string key = Word();
      Expect("=");
      Value(meta[key]);
    }
    while (!Peek().empty()) Prim("");
  }

  std::map<std::string, Attribute> meta, attributes;
  std::map<std::string, std::string> prims;  // path to type

 private:
  void Prim(const std::string& parent) {
    Expect("def");
    const std::string type = Word();
    const std::string name = String();
    const std::string path = parent + "/" + name;
    if (!prims.emplace(path, type).second) throw std::runtime_error("two of " + path);
    if (Try("(")) {
      while (!Try(")")) {
        Try("prepend");
        const std::string key = Word();
        Expect("=");
        Value(attributes[path + "()." + key]);
      }
    }
    Expect("{");
    while (!Try("}")) {
      if (Peek() == "def") {
        Prim(path);
        continue;
      }
      Attribute attribute;
      attribute.uniform = Try("uniform");
      attribute.type = Word();
      if (Try("[")) {
        Expect("]");
        attribute.type += "[]";
      }
      std::string name_of = Word();
      const bool sampled = name_of.ends_with(".timeSamples");
      if (sampled) name_of.resize(name_of.size() - 12);
      Expect("=");
      if (sampled) {
        Expect("{");
        while (!Try("}")) {
          const double time = std::stod(Word());
          Expect(":");
          Attribute value;
          Value(value);
          if (!attribute.samples.emplace(time, value.numbers).second) {
            throw std::runtime_error("a time twice");
          }
          Expect(",");
        }
      } else {
        Value(attribute);
      }
      if (Try("(")) {
        while (!Try(")")) {
          const std::string key = Word();
          Expect("=");
          Value(attributes[path + "." + name_of + "()." + key]);
        }
      }
      if (!attributes.emplace(path + "." + name_of, attribute).second) {
        throw std::runtime_error("an attribute twice: " + name_of);
      }
    }
  }

  void Value(Attribute& into) {
    const std::string next = Peek();
    if (next == "\"") {
      into.words.push_back(String());
    } else if (next == "<") {
      const std::size_t end = text_.find('>', at_);
      if (end == std::string::npos) throw std::runtime_error("an open path");
      into.words.push_back(text_.substr(at_ + 1, end - at_ - 1));
      at_ = end + 1;
    } else if (next == "[" || next == "(") {
      Expect(next);
      const std::string close = next == "[" ? "]" : ")";
      do {
        Value(into);
      } while (Try(","));
      Expect(close);
    } else {
      std::size_t used = 0;
      const std::string word = Word();
      into.numbers.push_back(std::stod(word, &used));
      if (used != word.size()) throw std::runtime_error("no number: " + word);
    }
  }

  static bool IsWord(char c) {
    return std::isalnum(static_cast<unsigned char>(c)) || c == '_' || c == '.' || c == '-' ||
           c == '+';
  }
  void Skip() {
    while (at_ < text_.size() && std::isspace(static_cast<unsigned char>(text_[at_]))) ++at_;
  }
  // A word, or one character of punctuation; empty at the end.
  std::string Peek() {
    Skip();
    std::size_t end = at_;
    while (end < text_.size() && IsWord(text_[end])) ++end;
    if (end == at_ && end < text_.size()) ++end;
    return text_.substr(at_, end - at_);
  }
  bool Try(const std::string& token) {
    if (Peek() != token) return false;
    at_ += token.size();
    return true;
  }
  void Expect(const std::string& token) {
    if (!Try(token)) throw std::runtime_error("expected " + token + ", found " + Peek());
  }
  std::string Word() {
    std::string word = Peek();
    if (word.empty() || !IsWord(word[0])) throw std::runtime_error("expected a word: " + word);
    at_ += word.size();
    // Names may have a namespace, as in primvars:displayColor; a time's colon has a blank after it.
    while (at_ + 1 < text_.size() && text_[at_] == ':' && IsWord(text_[at_ + 1])) {
      ++at_;
      word += ':' + Peek();
      at_ = at_ + word.size() - word.rfind(':') - 1;
    }
    return word;
  }
  std::string String() {
    Expect("\"");
    std::string result;
    while (at_ < text_.size() && text_[at_] != '"') {
      if (text_[at_] == '\n') throw std::runtime_error("a string over two lines");
      if (text_[at_] == '\\') ++at_;
      result += text_[at_++];
    }
    if (at_ == text_.size()) throw std::runtime_error("an open string");
    ++at_;
    return result;
  }

  std::string text_;
  std::size_t at_ = 0;
};

using Rows4 = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>;

// The skinned points of a stage at a time, as UsdSkel defines them: blend shapes, then linear blend
// skinning of row vectors by inverse(bind) * joint.
Eigen::Matrix3Xd SkinnedAt(UsdaReader& file, double time) {
  const std::string skin = "/World/body/skin.", skeleton = "/World/body/skeleton.",
                    motion = "/World/body/skeleton/motion.";
  const std::vector<double>& points = file.attributes[skin + "points"].numbers;
  Eigen::Matrix3Xd rest = Eigen::Map<const Eigen::Matrix3Xd>(
      points.data(), 3, static_cast<Eigen::Index>(points.size() / 3));
  const auto& targets = file.attributes[skin + "skel:blendShapeTargets"].words;
  const std::vector<double>& weights = file.attributes[motion + "blendShapeWeights"].samples[time];
  EXPECT_EQ(weights.size(), targets.size());
  for (std::size_t k = 0; k < targets.size(); ++k) {
    const auto& ids = file.attributes[targets[k] + ".pointIndices"].numbers;
    const auto& offsets = file.attributes[targets[k] + ".offsets"].numbers;
    EXPECT_EQ(offsets.size(), 3 * ids.size());
    for (std::size_t i = 0; i < ids.size(); ++i) {
      rest.col(static_cast<Eigen::Index>(ids[i])) +=
          weights[k] * Eigen::Map<const Eigen::Vector3d>(&offsets[3 * i]);
    }
  }
  const std::vector<std::string>& joints = file.attributes[motion + "joints"].words;
  EXPECT_EQ(joints, file.attributes[skeleton + "joints"].words);
  const std::vector<double>& turns = file.attributes[motion + "rotations"].samples[time];
  const std::vector<double>& places = file.attributes[motion + "translations"].samples[time];
  const std::vector<double>& binds = file.attributes[skeleton + "bindTransforms"].numbers;
  std::map<std::string, Rows4> world;
  std::vector<Rows4> skinning;
  for (std::size_t j = 0; j < joints.size(); ++j) {
    Rows4 local = Rows4::Identity();
    local.topLeftCorner<3, 3>() =
        Eigen::Quaterniond(turns[4 * j], turns[4 * j + 1], turns[4 * j + 2], turns[4 * j + 3])
            .toRotationMatrix()
            .transpose();
    local.bottomLeftCorner<1, 3>() = Eigen::Map<const Eigen::RowVector3d>(&places[3 * j]);
    const std::size_t slash = joints[j].rfind('/');
    world[joints[j]] =
        slash == std::string::npos ? local : Rows4(local * world.at(joints[j].substr(0, slash)));
    skinning.push_back(Eigen::Map<const Rows4>(&binds[16 * j]).inverse() * world[joints[j]]);
  }
  const std::string indices = skin + "primvars:skel:jointIndices";
  const auto each =
      static_cast<std::size_t>(file.attributes[indices + "().elementSize"].numbers.at(0));
  const std::vector<double>& ids = file.attributes[indices].numbers;
  const std::vector<double>& shares = file.attributes[skin + "primvars:skel:jointWeights"].numbers;
  EXPECT_EQ(ids.size(), each * static_cast<std::size_t>(rest.cols()));
  Eigen::Matrix3Xd skinned(3, rest.cols());
  for (Eigen::Index v = 0; v < rest.cols(); ++v) {
    Eigen::RowVector4d sum = Eigen::RowVector4d::Zero();
    for (std::size_t k = 0; k < each; ++k) {
      const std::size_t at = each * static_cast<std::size_t>(v) + k;
      sum += shares[at] * rest.col(v).homogeneous().transpose() *
             skinning[static_cast<std::size_t>(ids[at])];
    }
    skinned.col(v) = sum.head<3>().transpose();
  }
  return skinned;
}

TEST(UsdaWriter, SkinsTheBodyAndMovesTheObject) {
  const TemporaryFolder folder;
  const auto body = BodyModel::Default();
  const BodySurface surface(body, Eigen::VectorXd::Constant(10, 0.5));
  const Clip clip = MakeMovingClip(7, 1);
  const TriangleMesh object = Tetrahedron();
  ExportOptions options;
  options.every = 3;
  options.generator = "a \"quoted\" name\nof two lines";
  const SkinReport report = WriteUsda(clip, surface, &object, options, folder / "a.usda");
  EXPECT_GT(report.morph_targets, 0);
  UsdaReader file(ReadFile(folder / "a.usda"));

  EXPECT_EQ(file.meta["upAxis"].words.at(0), "Z");
  EXPECT_EQ(file.meta["metersPerUnit"].numbers.at(0), 1);
  EXPECT_EQ(file.meta["timeCodesPerSecond"].numbers.at(0), clip.frame_rate);
  EXPECT_EQ(file.meta["endTimeCode"].numbers.at(0), 6);
  EXPECT_EQ(file.prims["/" + file.meta["defaultPrim"].words.at(0)], "Xform");
  EXPECT_EQ(file.prims["/World/body"], "SkelRoot");
  EXPECT_EQ(file.prims["/World/body/skeleton"], "Skeleton");
  EXPECT_EQ(file.prims["/World/body/skin"], "Mesh");
  EXPECT_EQ(file.prims["/World/object"], "Mesh");
  EXPECT_EQ(file.attributes["/World/body/skin().apiSchemas"].words.at(0), "SkelBindingAPI");
  EXPECT_EQ(file.attributes["/World/body/skin.skel:skeleton"].words.at(0), "/World/body/skeleton");
  const auto& motion = file.attributes["/World/body/skeleton.skel:animationSource"].words.at(0);
  EXPECT_EQ(file.prims[motion], "SkelAnimation");
  EXPECT_EQ(file.attributes[motion + ".blendShapes"].words,
            file.attributes["/World/body/skin.skel:blendShapes"].words);

  BodyState state;
  for (const int t : {0, 3, 6}) {
    Forward(surface, clip.pose[t], clip.trans.col(t), state);
    const Eigen::Matrix3Xd skinned = SkinnedAt(file, t);
    ASSERT_EQ(skinned.cols(), state.vertices.cols());
    EXPECT_LT((skinned - state.vertices).colwise().norm().maxCoeff(),
              report.corrective_error_m + 3e-5);
    const std::vector<double>& m = file.attributes["/World/object.xformOp:transform"].samples.at(t);
    ASSERT_EQ(m.size(), 16u);
    const Eigen::Map<const Rows4> M(m.data());
    const Eigen::Matrix3Xd placed = clip.object->Pose(t) * object.vertices;
    for (int v = 0; v < 4; ++v) {
      const Eigen::RowVector4d row = object.vertices.col(v).homogeneous().transpose() * M;
      EXPECT_LT((row.head<3>().transpose() - placed.col(v)).norm(), 1e-5);
    }
  }
  EXPECT_EQ(file.attributes["/World/object.xformOpOrder"].words.at(0), "xformOp:transform");
  EXPECT_TRUE(file.attributes["/World/object.xformOpOrder"].uniform);
  for (const char* name : {"/World/body/skin", "/World/object"}) {
    const std::string path = name;
    const auto& faces = file.attributes[path + ".faceVertexIndices"].numbers;
    EXPECT_EQ(faces.size(), 3 * file.attributes[path + ".faceVertexCounts"].numbers.size());
    EXPECT_GT(faces.size(), 0u);
  }
}

TEST(UsdaWriter, ThreadsDoNotChangeABitAndABodyMayStandAlone) {
  const TemporaryFolder folder;
  const auto body = BodyModel::Default();
  const BodySurface surface(body, {}, body->HandVertexIds(Side::kLeft));
  const Clip clip = MakeMovingClip(70, 2);
  ExportOptions options;
  WriteUsda(clip, surface, nullptr, options, folder / "one.usda");
  options.threads = 4;
  WriteUsda(clip, surface, nullptr, options, folder / "four.usda");
  EXPECT_EQ(ReadFile(folder / "one.usda"), ReadFile(folder / "four.usda"));
  options.correctives = false;
  EXPECT_EQ(WriteUsda(clip, surface, nullptr, options, folder / "plain.usda").morph_targets, 0);
  UsdaReader file(ReadFile(folder / "plain.usda"));
  EXPECT_EQ(file.prims.count("/World/object"), 0u);
  EXPECT_EQ(file.attributes["/World/body/skeleton/motion.rotations"].samples.size(), 70u);
  EXPECT_EQ(file.attributes.count("/World/body/skin.skel:blendShapes"), 0u);
}

TEST(SceneLines, HoldPosesAndContacts) {
  const TemporaryFolder folder;
  ClipScene scene;
  scene.clip = MakeMovingClip(5, 3);
  scene.body = BodyModel::Default();
  scene.betas = Eigen::VectorXd::Zero(0);
  const TriangleMesh object = Tetrahedron();
  scene.object = object;
  // The object at the right wrist, so that it touches.
  const BodySurface surface = scene.Surface();
  BodyState state;
  for (int t = 0; t < 5; ++t) {
    ForwardJoints(surface.RestJoints(), scene.clip.pose[t], scene.clip.trans.col(t), state);
    scene.clip.object->SetPose(t, state.WorldFromJoint(WristJoint(Side::kRight)));
  }
  ExportOptions options;
  options.every = 2;
  WriteSceneLines(scene, &object, options, folder / "a.jsonl");
  std::istringstream lines(ReadFile(folder / "a.jsonl"));
  std::vector<nlohmann::json> read;
  for (std::string line; std::getline(lines, line);) read.push_back(nlohmann::json::parse(line));
  ASSERT_EQ(read.size(), 4u);
  EXPECT_EQ(read[0]["joints"].size(), 55u);
  EXPECT_EQ(read[0]["object"]["faces"].size(), 4u);
  std::size_t contacts = 0;
  for (const int k : {1, 2, 3}) {
    const int t = 2 * (k - 1);
    EXPECT_EQ(read[k]["frame"], t);
    ForwardJoints(surface.RestJoints(), scene.clip.pose[t], scene.clip.trans.col(t), state);
    for (const int j : {0, 21, 54}) {
      const nlohmann::json& pose = read[k]["joints"][j];
      const std::vector<double> p = pose["position"], q = pose["wxyz"];
      EXPECT_LT((state.WorldFromJoint(j).translation() - Eigen::Vector3d(p[0], p[1], p[2])).norm(),
                2e-6);
      EXPECT_LT(Eigen::Quaterniond(q[0], q[1], q[2], q[3])
                    .angularDistance(Eigen::Quaterniond(state.WorldFromJoint(j).linear())),
                1e-5);
    }
    contacts += read[k]["contacts"].size();
    for (const nlohmann::json& contact : read[k]["contacts"]) EXPECT_EQ(contact["hand"], "right");
  }
  EXPECT_GT(contacts, 0u);
}

}  // namespace
}  // namespace holdfast
