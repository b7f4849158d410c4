// SPDX-License-Identifier: MIT
#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "generator/imos/weights.h"
#include "geometry/error.h"
#include "geometry/io/container/npz.h"
#include "tests/support/column_network_checks.h"
#include "tests/support/imos_scene.h"
#include "tests/support/temporary_folder.h"

namespace holdfast::imos {
namespace {

using holdfast::testing::TemporaryFolder;
using nn::testing::RunNetwork;
using nn::testing::SupportedIsas;
using testing::DrawnNetwork;
using ::testing::HasSubstr;
using wandr::testing::RelativeError;

double MillionsOf(const Config& config, const std::string& module, bool training) {
  long count = 0;
  for (const TensorShape& of : TensorsOf(config, training)) {
    if (!of.name.starts_with(module) || of.name.find("running_") != std::string::npos) continue;
    long size = 1;
    for (const std::size_t length : of.shape) size *= static_cast<long>(length);
    count += size;
  }
  return static_cast<double>(count) / 1e6;
}

TEST(ImosConfig, SizesAreThePublishedOnes) {
  const Config c = PaperConfig();
  EXPECT_EQ(c.ArmsConditionInput(), 522);
  EXPECT_EQ(c.ArmsPresentInput(), 439);
  EXPECT_EQ(c.ArmsPastInput(), 556);
  EXPECT_EQ(c.ArmsDecoderInput(), 588);
  EXPECT_EQ(c.BodyConditionInput(), 576);
  EXPECT_EQ(c.BodyPastInput(), 679);
  EXPECT_EQ(c.BodyDecoderInput(), 779);
  EXPECT_EQ(c.BodyOutput(), 96);
  EXPECT_NEAR(MillionsOf(c, "arms.", true), 22.0, 0.05);
  EXPECT_NEAR(MillionsOf(c, "arms.", false), 12.9, 0.05);
  EXPECT_NEAR(MillionsOf(c, "body.", true), 2.77, 0.01);
}

TEST(ImosConfig, TheCompactOneFitsSevenMegabytesAtHalfPrecision) {
  const TemporaryFolder folder;
  WriteNetwork(RandomNetwork(CompactConfig(), 1), folder.Path() / "n.safetensors", true);
  EXPECT_LT(std::filesystem::file_size(folder.Path() / "n.safetensors"), 7'000'000u);
}

TEST(ImosConfig, TextsComeBack) {
  for (Config config : {PaperConfig(), CompactConfig(), testing::SmallConfig()}) {
    config.has_arms = false;
    config.self_attention = false;
    config.arm_order = ArmOrder::kRightThenLeft;
    auto texts = ConfigTexts(config);
    texts["trained_on"] = "something";
    EXPECT_EQ(ConfigFromTexts(texts, "file"), config);
    EXPECT_EQ(texts.size(), 1u) << "what it does not know stays";
  }
  const auto with = [](const char* name, const char* text) {
    auto texts = ConfigTexts(PaperConfig());
    texts[name] = text;
    return ConfigFromTexts(texts, "file");
  };
  EXPECT_THROW(with("arms_latent", "0"), Error);
  EXPECT_THROW(with("arms_latent", "-3"), Error);
  EXPECT_THROW(with("arms_latent", "12x"), Error);
  EXPECT_THROW(with("arms_latent", "99999999"), Error);
  EXPECT_THROW(with("attention_heads", "65536"), Error);
  EXPECT_THROW(with("attention_layers", "65"), Error);
  EXPECT_THROW(with("modules", "three"), Error);
  auto texts = ConfigTexts(PaperConfig());
  texts.erase("root");
  EXPECT_THROW(ConfigFromTexts(texts, "file"), Error);
}

// One residual block by its definition: unfolded, one column.
class PlainBlock {
 public:
  PlainBlock(const nn::TensorMap& tensors, std::string name)
      : tensors_(tensors), name_(std::move(name)) {}

  Eigen::VectorXd operator()(const Eigen::VectorXd& x) const {
    const Eigen::VectorXd branch = Norm("bn2", Linear("fc2", Leaky(Norm("bn1", Linear("fc1", x)))));
    const bool has_skip = tensors_.contains(name_ + ".fc3.weight");
    return Leaky((has_skip ? Leaky(Linear("fc3", x)) : x) + branch);
  }

  Eigen::VectorXd Norm(const std::string& part, const Eigen::VectorXd& x) const {
    const std::string name = part.empty() ? name_ : name_ + "." + part;
    const Eigen::ArrayXd mean = Vector(name + ".running_mean"),
                         variance = Vector(name + ".running_var");
    return (x.array() - mean) / (variance + 1e-5).sqrt() * Vector(name + ".weight").array() +
           Vector(name + ".bias").array();
  }

 private:
  Eigen::VectorXd Vector(const std::string& name) const {
    const std::vector<float>& values = tensors_.at(name).values;
    return Eigen::Map<const Eigen::VectorXf>(values.data(),
                                             static_cast<Eigen::Index>(values.size()))
        .cast<double>();
  }
  Eigen::VectorXd Linear(const std::string& part, const Eigen::VectorXd& x) const {
    return nn::ReadMatrix(tensors_, name_ + "." + part + ".weight", "test").cast<double>() * x +
           Vector(name_ + "." + part + ".bias");
  }
  static Eigen::VectorXd Leaky(const Eigen::VectorXd& x) {
    return x.unaryExpr([](double v) { return v > 0.0 ? v : 0.2 * v; });
  }

  const nn::TensorMap& tensors_;
  std::string name_;
};

Eigen::VectorXd Joined(const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
  Eigen::VectorXd both(a.size() + b.size());
  both << a, b;
  return both;
}

// The arms' decoder and encoder (mu alone) and the condition, column by column.
Eigen::MatrixXd PlainDecoder(const nn::TensorMap& t, const Eigen::MatrixXd& x) {
  Eigen::MatrixXd y(kArmsSize, x.cols());
  for (Eigen::Index j = 0; j < x.cols(); ++j) {
    const Eigen::VectorXd first =
        PlainBlock(t, "arms.dec_rb1")(PlainBlock(t, "arms.dec_bn1").Norm("", x.col(j)));
    y.col(j) = PlainBlock(t, "arms.dec_rb2")(Joined(x.col(j), first));
  }
  return y;
}
Eigen::MatrixXd PlainEncoder(const nn::TensorMap& t, const Eigen::MatrixXd& x) {
  const Eigen::MatrixXd mu = nn::ReadMatrix(t, "arms.mu_past.weight", "test").cast<double>(),
                        sigma = nn::ReadMatrix(t, "arms.sigma_past.weight", "test").cast<double>();
  Eigen::MatrixXd y(2 * mu.rows(), x.cols());
  for (Eigen::Index j = 0; j < x.cols(); ++j) {
    const Eigen::VectorXd normed = PlainBlock(t, "arms.enc_bn1_past").Norm("", x.col(j));
    const Eigen::VectorXd h = PlainBlock(
        t, "arms.enc_rb2_past")(Joined(normed, PlainBlock(t, "arms.enc_rb1_past")(normed)));
    const auto bias = [&](const char* name) -> Eigen::VectorXd {
      return nn::ReadVector(t, name, "test", mu.rows()).cast<double>();
    };
    y.col(j) = Joined(mu * h + bias("arms.mu_past.bias"), sigma * h + bias("arms.sigma_past.bias"));
  }
  return y;
}
Eigen::MatrixXd PlainCondition(const nn::TensorMap& t, const Eigen::MatrixXd& x, int size) {
  Eigen::MatrixXd y(size, x.cols());
  for (Eigen::Index j = 0; j < x.cols(); ++j) {
    y.col(j) = PlainBlock(t, "arms.enc_rb0")(PlainBlock(t, "arms.enc_bn0").Norm("", x.col(j)));
  }
  return y;
}

// As long as its input, its block has no third layer.
Config StraightConfig() {
  Config config = testing::SmallConfig();
  config.arms_condition = config.ArmsConditionInput();
  return config;
}

TEST(BlockNetwork, IsItsDefinitionOnEveryInstructionSet) {
  std::srand(3);
  for (const Config& config : {testing::SmallConfig(), StraightConfig()}) {
    const NetworkWeights weights = DrawnNetwork(config, 4);
    for (const int columns : {1, 2, 6, 7, 13}) {
      const auto input = [&](int rows) { return Eigen::MatrixXd::Random(rows, columns).eval(); };
      const Eigen::MatrixXd c = input(config.ArmsConditionInput()),
                            e = input(config.ArmsPastInput()), d = input(config.ArmsDecoderInput());
      const Eigen::MatrixXd expected_c = PlainCondition(weights.tensors, c, config.arms_condition),
                            expected_e = PlainEncoder(weights.tensors, e),
                            expected_d = PlainDecoder(weights.tensors, d);
      for (const Isa isa : SupportedIsas()) {
        SCOPED_TRACE(std::string(IsaName(isa)) + ", columns: " + std::to_string(columns));
        const Network<double> exact(weights, isa);
        EXPECT_LT(RelativeError(RunNetwork(exact.ArmsCondition(), c), expected_c), 1e-13);
        EXPECT_LT(RelativeError(RunNetwork(exact.ArmsEncoder(), e), expected_e), 1e-13);
        EXPECT_LT(RelativeError(RunNetwork(exact.ArmsDecoder(), d), expected_d), 1e-13);
        const Network<float> single(weights, isa);
        EXPECT_LT(RelativeError(RunNetwork(single.ArmsCondition(), c), expected_c), 5e-6);
        EXPECT_LT(RelativeError(RunNetwork(single.ArmsEncoder(), e), expected_e), 5e-6);
        EXPECT_LT(RelativeError(RunNetwork(single.ArmsDecoder(), d), expected_d), 5e-6);
      }
    }
  }
}

TEST(BlockNetwork, AColumnDoesNotDependOnItsNeighbors) {
  const NetworkWeights weights = DrawnNetwork(CompactConfig(), 2);
  for (const Isa isa : SupportedIsas()) {
    SCOPED_TRACE(IsaName(isa));
    const Network<float> network(weights, isa);
    nn::testing::CheckColumnsAreAlone(
        network.BodyEncoder(), Eigen::MatrixXd::Random(network.BodyEncoder().InputSize(), 23));
  }
}

// Attention by the paper's steps: heads of `width`, queries, keys, values, and what combines them.
Eigen::VectorXd PlainAttention(const NetworkWeights& weights, const Eigen::VectorXd& pose) {
  const Config& c = weights.config;
  const int joints = c.BodyJoints(), width = c.attention_width;
  Eigen::MatrixXd tokens = Eigen::Map<const Eigen::MatrixXd>(pose.data(), 6, joints).transpose();
  for (int p = 0; p < joints; ++p) {
    for (int i = 0; i < 6; i += 2) {
      tokens(p, i) += 1e-3 * std::sin(p / std::pow(10000.0, 2.0 * i / 6.0));
      tokens(p, i + 1) += 1e-3 * std::cos(p / std::pow(10000.0, 2.0 * (i + 1) / 6.0));
    }
  }
  Eigen::MatrixXd state = tokens;
  for (int l = 0; l < c.attention_layers; ++l) {
    const std::string name =
        "body.attention_model.attention_layers." + std::to_string(l) + ".attn.";
    const auto matrix = [&](const char* part) -> Eigen::MatrixXd {
      return nn::ReadMatrix(weights.tensors, name + part, "test").cast<double>();
    };
    const Eigen::MatrixXd q = state * matrix("w_qs.weight").transpose(),
                          k = tokens * matrix("w_ks.weight").transpose(),
                          v = tokens * matrix("w_vs.weight").transpose();
    Eigen::MatrixXd heads(joints, c.attention_heads * width);
    for (int h = 0; h < c.attention_heads; ++h) {
      const auto of = [&](const Eigen::MatrixXd& m) { return m.middleCols(h * width, width); };
      Eigen::MatrixXd p = (of(q) * of(k).transpose() / std::sqrt(double(width))).array().exp();
      for (int r = 0; r < joints; ++r) p.row(r) /= p.row(r).sum();
      heads.middleCols(h * width, width) = p * of(v);
    }
    const Eigen::MatrixXd sum = state + heads * matrix("w_combine.weight").transpose();
    const Eigen::ArrayXXd centerd = sum.array() - sum.mean();
    const double variance = centerd.square().mean();
    state = centerd / std::sqrt(variance + 1e-6) * matrix("layer_norm.weight").array() +
            matrix("layer_norm.bias").array();
  }
  const Eigen::MatrixXd by_joint = state.transpose();
  return Eigen::Map<const Eigen::VectorXd>(by_joint.data(), by_joint.size());
}

TEST(SelfAttention, IsItsDefinition) {
  std::srand(7);
  Config one = testing::SmallConfig();
  one.has_arms = false;
  one.attention_heads = 3;
  one.attention_width = 5;
  for (const Config& config : {PaperConfig(), one}) {
    const NetworkWeights weights = DrawnNetwork(config, 9);
    const Network<double> network(weights);
    const Network<float> single(weights);
    for (int k = 0; k < 5; ++k) {
      const Eigen::VectorXd pose =
          2.0 * Eigen::VectorXf::Random(config.BodyPoseSize()).cast<double>();
      const Eigen::VectorXd expected = PlainAttention(weights, pose);
      Eigen::VectorXd found(pose.size());
      network.SelfAttention()->Forward(pose.data(), found.data());
      EXPECT_LT(RelativeError(found, expected), 1e-13);
      const Eigen::VectorXf single_pose = pose.cast<float>();
      Eigen::VectorXf single_found(pose.size());
      single.SelfAttention()->Forward(single_pose.data(), single_found.data());
      EXPECT_LT(RelativeError(single_found.cast<double>(), expected), 1e-5);
    }
  }
}

TEST(SelfAttention, PositionsAreThePublishedOnes) {
  const Eigen::MatrixXd code = PositionalEncoding(16);
  EXPECT_DOUBLE_EQ(code(0, 0), 0.0);
  EXPECT_DOUBLE_EQ(code(1, 0), 1.0);
  EXPECT_NEAR(code(0, 3), std::sin(3.0), 1e-15);
  EXPECT_NEAR(code(1, 3), std::cos(3.0 / std::pow(10000.0, 1.0 / 3.0)), 1e-15);
  EXPECT_NEAR(code(4, 15), std::sin(15.0 / std::pow(10000.0, 4.0 / 3.0)), 1e-15);
}

TEST(ImosWeights, ComeBackFromAFile) {
  const TemporaryFolder folder;
  const std::filesystem::path path = folder.Path() / "n.safetensors";
  for (const bool training : {false, true}) {
    NetworkWeights weights = DrawnNetwork(testing::SmallConfig(), 11, training);
    weights.notes["license"] = "MIT";
    WriteNetwork(weights, path);
    const NetworkWeights read = ReadNetwork(path);
    EXPECT_EQ(read.config, weights.config);
    EXPECT_EQ(read.notes, weights.notes);
    EXPECT_EQ(read.HasPresentEncoder(), training);
    ASSERT_EQ(read.tensors.size(), weights.tensors.size());
    for (const auto& [name, tensor] : weights.tensors) {
      EXPECT_EQ(read.tensors.at(name).values, tensor.values) << name;
    }
    EXPECT_EQ(WithoutTraining(read).tensors.size(), TensorsOf(weights.config, false).size());
  }
}

TEST(ImosWeights, HalfPrecisionMovesLittle) {
  const TemporaryFolder folder;
  const Config config = CompactConfig();
  const NetworkWeights weights = RandomNetwork(config, 12);
  WriteNetwork(weights, folder.Path() / "n.safetensors", true);
  const Network<float> half(ReadNetwork(folder.Path() / "n.safetensors")), whole(weights);
  const testing::Given<float> given = testing::RandomGiven(config, 3, 15, 1).Cast<float>();
  Rollout<float> a(whole, 3, 15), b(half, 3, 15);
  testing::Roll(a, given, config.NoiseSize());
  testing::Roll(b, given, config.NoiseSize());
  const float difference = (a.Frame(14).pose - b.Frame(14).pose).cwiseAbs().maxCoeff();
  EXPECT_GT(difference, 0.0f);
  EXPECT_LT(difference, 1e-2f);  // eleven steps add up, of weights that were not trained
}

TEST(ImosWeights, RandomOnesAreThePublishedStart) {
  const NetworkWeights a = RandomNetwork(CompactConfig(), 1), b = RandomNetwork(CompactConfig(), 1),
                       c = RandomNetwork(CompactConfig(), 2);
  const std::string name = "body.dec_rb2.fc3.weight";
  const std::vector<float>& values = a.tensors.at(name).values;
  EXPECT_EQ(values, b.tensors.at(name).values);
  EXPECT_NE(values, c.tensors.at(name).values);
  const Eigen::Map<const Eigen::VectorXf> all(values.data(),
                                              static_cast<Eigen::Index>(values.size()));
  EXPECT_NEAR(all.mean(), 0.0, 3e-4);
  EXPECT_NEAR(std::sqrt(all.array().square().mean()), 0.02, 3e-4);
  for (const float v : a.tensors.at("arms.enc_bn0.running_var").values) EXPECT_EQ(v, 1.0f);
}

// A file as WriteNetwork makes it, spoiled.
template <typename Spoil>
std::string ErrorOfFile(const Spoil& spoil) {
  const TemporaryFolder folder;
  const std::filesystem::path path = folder.Path() / "n.safetensors";
  NetworkWeights weights = DrawnNetwork(testing::SmallConfig(), 13, true);
  SafetensorsMetadata texts;
  for (const auto& [name, text] : ConfigTexts(weights.config)) texts[name] = text;
  texts["format"] = "imos-1";
  spoil(weights.tensors, texts);
  SafetensorsWriter writer;
  for (const auto& [name, tensor] : weights.tensors) {
    writer.AddFloat32(name, tensor.shape, tensor.values);
  }
  writer.SetMetadata(texts);
  writer.Write(path);
  try {
    ReadNetwork(path);
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr(path.string()));
    return error.what();
  }
  return "no error";
}

TEST(ImosWeights, SpoiledFilesAreRefusedByName) {
  using Texts = SafetensorsMetadata;
  EXPECT_EQ(ErrorOfFile([](nn::TensorMap&, Texts&) {}), "no error");
  EXPECT_THAT(ErrorOfFile([](nn::TensorMap& t, Texts&) { t.erase("arms.dec_rb1.fc2.bias"); }),
              HasSubstr("there is no tensor 'arms.dec_rb1.fc2.bias'"));
  EXPECT_THAT(ErrorOfFile([](nn::TensorMap& t, Texts&) { t.erase("arms.enc_rb2.fc2.bias"); }),
              HasSubstr("there is no tensor 'arms.enc_rb2.fc2.bias'"));
  EXPECT_THAT(ErrorOfFile([](nn::TensorMap& t, Texts&) {
                t["body.enc_rb9.fc1.bias"] = {{1}, {0}};
              }),
              HasSubstr("have no tensor 'body.enc_rb9.fc1.bias'"));
  EXPECT_THAT(ErrorOfFile([](nn::TensorMap& t, Texts&) {
                nn::Tensor& tensor = t.at("body.mu_past.weight");
                std::swap(tensor.shape[0], tensor.shape[1]);
              }),
              HasSubstr("'body.mu_past.weight' is 10 x 6, 6 x 10 is needed"));
  EXPECT_THAT(ErrorOfFile([](nn::TensorMap& t, Texts&) {
                t.at("body.mu_past.weight").values[3] = std::numeric_limits<float>::quiet_NaN();
              }),
              HasSubstr("'body.mu_past.weight' holds values that are not finite"));
  EXPECT_THAT(ErrorOfFile([](nn::TensorMap& t, Texts&) {
                t.at("body.enc_bn0.running_var").values[3] = -1.0f;
              }),
              HasSubstr("'body.enc_bn0.running_var' holds negative variances"));
  EXPECT_THAT(ErrorOfFile([](nn::TensorMap&, Texts& m) { m["format"] = "imos-2"; }),
              HasSubstr("its format is 'imos-2', not 'imos-1'"));
  EXPECT_THAT(ErrorOfFile([](nn::TensorMap&, Texts& m) { m.erase("format"); }),
              HasSubstr("lacks the format 'imos-1'"));
  EXPECT_THAT(ErrorOfFile([](nn::TensorMap&, Texts& m) { m["body_latent"] = "1000"; }),
              HasSubstr("is needed"));
}

TEST(ImosImport, FilesOfAnotherKindAreRefused) {
  const std::filesystem::path fixtures = HOLDFAST_SOURCE_DIR "/tests/fixtures";
  const std::filesystem::path arms = fixtures / "imos" / "arms.p", body = fixtures / "imos/body.p";
  const auto error_of = [](const std::filesystem::path& a, const std::filesystem::path& b,
                           const ImportWeightsOptions& options = {}) -> std::string {
    try {
      ImportWeights(a, b, options);
    } catch (const Error& error) {
      return error.what();
    }
    return "no error";
  };
  EXPECT_EQ(error_of(arms, body), "no error");
  EXPECT_THAT(error_of(body, arms), HasSubstr("in that order"));
  EXPECT_THAT(error_of(fixtures / "torch/views.pt", body), HasSubstr("no tensor that belongs"));
  EXPECT_THAT(error_of(arms, fixtures / "imos/missing.p"), HasSubstr("missing.p"));
  ImportWeightsOptions three;
  three.attention_heads = 3;
  EXPECT_THAT(error_of(arms, body, three), HasSubstr("3 heads"));
  const ImportedWeights imported = ImportWeights(arms, body, {});
  EXPECT_FALSE(imported.weights.HasPresentEncoder());
  EXPECT_THAT(imported.ignored, ::testing::Contains("arms.female_model.shapedirs"));
  EXPECT_THROW(ActionTable(imported.weights), Error);
}

TEST(ActionTables, AreReadByLabelAndInOnePiece) {
  const TemporaryFolder folder;
  const std::filesystem::path one = folder.Path() / "one.npz",
                              labels = folder.Path() / "labels.npz";
  Eigen::MatrixXf table(kNumActions, 4);
  NpzWriter by_label, whole;
  std::vector<float> all;
  for (int a = 0; a < kNumActions; ++a) {
    const Eigen::Vector4f row = Eigen::Vector4f::Random();
    table.row(a) = row.transpose();
    by_label.AddFloat32(std::string(Actions()[a].label), {1, 4}, {row.begin(), row.end()});
    all.insert(all.end(), row.begin(), row.end());
  }
  by_label.Write(labels);
  whole.AddFloat32("embeddings", {kNumActions, 4}, all);
  whole.Write(one);
  EXPECT_EQ(ReadActionTable(labels, 4), table);
  EXPECT_EQ(ReadActionTable(one, 4), table);
  const NetworkWeights others = RandomNetwork(testing::SmallConfig(), 1);
  WriteNetwork(others, folder.Path() / "others.safetensors");
  EXPECT_EQ(ReadActionTable(folder.Path() / "others.safetensors", 7), ActionTable(others));
  EXPECT_THROW(ReadActionTable(labels, 512), Error);
  EXPECT_THROW(ReadActionTable(one, 512), Error);
  EXPECT_EQ(ActionVectorSize(labels), 4);
  EXPECT_EQ(ActionVectorSize(one), 4);
  // A sentence beside the actions.
  const Eigen::Vector4f near = table.row(5).transpose() * 2.0f + Eigen::Vector4f::Constant(0.01f);
  by_label.AddFloat32("bite it", {4}, {near.begin(), near.end()});
  by_label.Write(folder.Path() / "sentence.npz");
  const std::vector<std::string> offered{"drink", std::string(Actions()[5].label)};
  const auto nearest = FindNearestAction(folder.Path() / "sentence.npz", "bite it", offered);
  ASSERT_TRUE(nearest);
  EXPECT_EQ(nearest->action, 5);
  EXPECT_GT(nearest->cosine, 0.99);
  EXPECT_FALSE(FindNearestAction(labels, "bite it", offered));
  NpzWriter few;
  few.AddFloat32("drink", {4}, {1, 2, 3, 4});
  few.Write(folder.Path() / "few.npz");
  EXPECT_THROW(ReadActionTable(folder.Path() / "few.npz", 4), Error);
}

}  // namespace
}  // namespace holdfast::imos
