// SPDX-License-Identifier: MIT
#include "geometry/export/export_clip.h"

#include <cctype>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "geometry/io/container/atomic_file.h"
#include "geometry/rotation.h"
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
          Word();
          Expect("=");
          Attribute ignored;
          Value(ignored);
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

TEST(UsdaWriter, HoldsTheBodysPointsAndTheObjectsTransform) {
  const TemporaryFolder folder;
  const auto body = BodyModel::Default();
  const BodySurface surface(body, {}, body->HandVertexIds(Side::kRight));
  const Clip clip = MakeMovingClip(7, 1);
  const TriangleMesh object = Tetrahedron();
  ExportOptions options;
  options.every = 3;
  options.generator = "a \"quoted\" name\nof two lines";
  WriteUsda(clip, surface, &object, options, folder / "a.usda");
  UsdaReader file(ReadFile(folder / "a.usda"));

  EXPECT_EQ(file.meta["upAxis"].words.at(0), "Z");
  EXPECT_EQ(file.meta["metersPerUnit"].numbers.at(0), 1);
  EXPECT_EQ(file.meta["timeCodesPerSecond"].numbers.at(0), clip.frame_rate);
  EXPECT_EQ(file.meta["endTimeCode"].numbers.at(0), 6);
  EXPECT_EQ(file.prims["/" + file.meta["defaultPrim"].words.at(0)], "Xform");
  EXPECT_EQ(file.prims["/World/body"], "Mesh");
  EXPECT_EQ(file.prims["/World/object"], "Mesh");

  const auto& points = file.attributes["/World/body.points"];
  EXPECT_EQ(points.type, "point3f[]");
  ASSERT_EQ(points.samples.size(), 3u);
  BodyState state;
  for (const int t : {0, 3, 6}) {
    Forward(surface, clip.pose[t], clip.trans.col(t), state);
    const std::vector<double>& numbers = points.samples.at(t);
    ASSERT_EQ(numbers.size(), static_cast<std::size_t>(state.vertices.size()));
    for (std::size_t k = 0; k < numbers.size(); ++k) {
      ASSERT_NEAR(numbers[k], state.vertices(static_cast<Eigen::Index>(k)), 5.1e-6);
    }
    const std::vector<double>& m = file.attributes["/World/object.xformOp:transform"].samples.at(t);
    ASSERT_EQ(m.size(), 16u);
    const Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> M(m.data());
    const Eigen::Matrix3Xd placed =
        (ExpSO3(clip.object->orient.col(t)) * object.vertices).colwise() +
        clip.object->trans.col(t);
    for (int v = 0; v < 4; ++v) {
      const Eigen::RowVector4d row = object.vertices.col(v).homogeneous().transpose() * M;
      EXPECT_LT((row.head<3>().transpose() - placed.col(v)).norm(), 1e-5);
    }
  }
  EXPECT_EQ(file.attributes["/World/object.xformOpOrder"].words.at(0), "xformOp:transform");
  EXPECT_TRUE(file.attributes["/World/object.xformOpOrder"].uniform);
  for (const char* name : {"/World/body", "/World/object"}) {
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
  const Clip clip = MakeMovingClip(70, 2);  // more than are formatted at once
  ExportOptions options;
  WriteUsda(clip, surface, nullptr, options, folder / "one.usda");
  options.threads = 4;
  WriteUsda(clip, surface, nullptr, options, folder / "four.usda");
  EXPECT_EQ(ReadFile(folder / "one.usda"), ReadFile(folder / "four.usda"));
  UsdaReader file(ReadFile(folder / "one.usda"));
  EXPECT_EQ(file.prims.count("/World/object"), 0u);
  EXPECT_EQ(file.attributes["/World/body.points"].samples.size(), 70u);
}

}  // namespace
}  // namespace holdfast
