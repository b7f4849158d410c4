// SPDX-License-Identifier: MIT
#include "geometry/io/pickle/pickle.h"

#include "tests/fuzz/data_checks.h"
#include "tests/fuzz/fuzz_target.h"

// Storages of torch are asked for beside the pickle: as many bytes as there could be in a file.
HOLDFAST_FUZZ_TARGET(pickle) {
  holdfast::PickleOptions options;
  options.storage = [](const holdfast::TorchStorageRequest&) {
    return holdfast::OwnBytes(std::vector<std::byte>(256));
  };
  std::size_t bytes_read = 0;
  const holdfast::DataValue root =
      holdfast::ReadPickle({trial.Bytes(), nullptr}, "values.pkl", options, &bytes_read);
  trial.Accept();
  holdfast::fuzz::Require(bytes_read > 0 && bytes_read <= trial.Bytes().size(),
                          "a pickle lies within its bytes");
  holdfast::fuzz::InterrogateAll(root);
}
