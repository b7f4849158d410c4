// SPDX-License-Identifier: MIT
#include "generator/imos/recognition.h"

#include <gtest/gtest.h>

namespace holdfast::imos {
namespace {

TEST(RandomRecognizer, HasThePublishedNumberOfParameters) {
  std::size_t count = 0;
  for (const auto& [name, tensor] : RandomRecognizer(1)) count += tensor.values.size();
  EXPECT_EQ(count, 446117u);
}

}  // namespace
}  // namespace holdfast::imos
