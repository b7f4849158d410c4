// SPDX-License-Identifier: MIT
#include "generator/imos/recognition.h"

#include <cmath>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "geometry/error.h"
#include "geometry/io/container/safetensors.h"
#include "tests/support/temporary_folder.h"

namespace holdfast::imos {
namespace {

using ::testing::HasSubstr;

JointMotion SwayingMotion(int which, int frames = 15) {
  return JointMotion::NullaryExpr(66, frames, [&](Eigen::Index r, Eigen::Index t) {
    const auto row = static_cast<double>(r), frame = static_cast<double>(t);
    return 0.8 * std::sin(0.31 * row + 0.17 * which) +
           0.05 * std::sin(0.4 * frame + 0.9 * row + 1.3 * which);
  });
}

std::vector<JointMotion> SwayingMotions(int count) {
  std::vector<JointMotion> motions;
  for (int k = 0; k < count; ++k) motions.push_back(SwayingMotion(k));
  return motions;
}

// Weights that another program can make too: the n-th tensor by name has (7919 k + 104729 n) mod
// 2003, less 1001, over 8008.
RecognizerWeights CountedWeights() {
  RecognizerWeights weights = RandomRecognizer(1);
  long index = 0;
  for (auto& [name, tensor] : weights.tensors) {
    for (std::size_t k = 0; k < tensor.values.size(); ++k) {
      const long value = (static_cast<long>(k) * 7919 + index * 104729) % 2003 - 1001;
      tensor.values[k] = static_cast<float>(static_cast<double>(value) / 8008.0);
    }
    ++index;
  }
  return weights;
}

std::string MessageOf(const RecognizerWeights& weights) {
  try {
    const Recognizer recognizer(weights, "a file");
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(Recognizer, HasThePublishedNumberOfParameters) {
  std::size_t count = 0;
  for (const auto& [name, tensor] : RandomRecognizer(1).tensors) count += tensor.values.size();
  EXPECT_EQ(count, 446117u);
}

// Expected numbers are of PyTorch's LSTM, Conv1d and Linear with the same weights.
TEST(Recognizer, ComputesWhatPyTorchDoes) {
  const Recognizer recognizer(CountedWeights());
  const Recognition seen = recognizer.Recognize(SwayingMotions(2));
  EXPECT_NEAR(seen.logits(0, 0), -0.05630884, 2e-6);
  EXPECT_NEAR(seen.logits(7, 0), 0.06170774, 2e-6);
  EXPECT_NEAR(seen.logits(28, 0), 0.09723508, 2e-6);
  EXPECT_NEAR(seen.logits(0, 1), -0.05867358, 2e-6);
  EXPECT_NEAR(seen.features(0, 0), -0.00855291, 1e-7);
  EXPECT_NEAR(seen.features(127, 0), -0.01101401, 1e-7);
  EXPECT_NEAR(seen.features(64, 1), -0.01096829, 1e-7);
  EXPECT_NEAR(seen.features.col(0).sum(), -1.3339789, 1e-5);
  EXPECT_EQ(seen.labels, (std::vector<int>{26, 26}));
}

TEST(Recognizer, SeesAMotionAloneAsAmongOthersAndByAnyNumberOfThreads) {
  const Recognizer recognizer(RandomRecognizer(4));
  const std::vector<JointMotion> motions = SwayingMotions(70);
  const Recognition all = recognizer.Recognize(motions, 1),
                    threads = recognizer.Recognize(motions, 3);
  EXPECT_EQ(all.features, threads.features);
  for (const int k : {0, 31, 32, 69}) {
    const Recognition one = recognizer.Recognize({&motions[k], 1});
    EXPECT_EQ(one.features.col(0), all.features.col(k)) << k;
    EXPECT_EQ(one.logits.col(0), all.logits.col(k)) << k;
  }
}

TEST(Recognizer, ComesBackFromItsFile) {
  const holdfast::testing::TemporaryFolder folder;
  RecognizerWeights weights = RandomRecognizer(5);
  weights.notes["set"] = "swaying";
  WriteRecognizer(weights, folder / "r.safetensors");
  const RecognizerWeights read = ReadRecognizer(folder / "r.safetensors");
  EXPECT_EQ(read.notes, weights.notes);
  const std::vector<JointMotion> motions = SwayingMotions(3);
  EXPECT_EQ(Recognizer(read).Recognize(motions).features,
            Recognizer(weights).Recognize(motions).features);
}

TEST(Recognizer, RefusesWeightsThatAreNoneOfIts) {
  RecognizerWeights missing = RandomRecognizer(1);
  missing.tensors.erase("lstm2_3.weight_hh_l1");
  EXPECT_THAT(MessageOf(missing), HasSubstr("a file: there is no tensor 'lstm2_3.weight_hh_l1'"));
  RecognizerWeights shape = RandomRecognizer(1);
  shape.tensors["hidden2label.weight"] = {{28, 128}, std::vector<float>(28 * 128)};
  EXPECT_THAT(MessageOf(shape), HasSubstr("28 x 128, 29 x 128 is needed"));
  RecognizerWeights kernel = RandomRecognizer(1);
  kernel.tensors["conv1_2_2.weight"] = {{1, 1, 5}, std::vector<float>(5)};
  EXPECT_THAT(MessageOf(kernel), HasSubstr("'conv1_2_2.weight' has 5 values, 3 are needed"));
  RecognizerWeights nan = RandomRecognizer(1);
  nan.tensors["lstm2_2.bias_ih_l0"].values[17] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THAT(MessageOf(nan), HasSubstr("not finite"));

  const holdfast::testing::TemporaryFolder folder;
  SafetensorsWriter writer;
  writer.SetMetadata({{"format", "wandr-1"}});
  writer.Write(folder / "other.safetensors");
  EXPECT_THROW(ReadRecognizer(folder / "other.safetensors"), Error);
}

TEST(Recognizer, RefusesMotionsItCannotSee) {
  const Recognizer recognizer(RandomRecognizer(1));
  std::vector<JointMotion> motions = SwayingMotions(2);
  motions[1](5, 7) = std::numeric_limits<double>::infinity();
  EXPECT_THROW(recognizer.Recognize(motions), Error);
  motions[1] = SwayingMotion(1, 14);
  EXPECT_THROW(recognizer.Recognize(motions), Error);
  motions[1] = SwayingMotion(1).topRows(63);
  EXPECT_THROW(recognizer.Recognize(motions), Error);
  EXPECT_EQ(recognizer.Recognize({}).features.cols(), 0);
}

}  // namespace
}  // namespace holdfast::imos
