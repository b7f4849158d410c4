// SPDX-License-Identifier: MIT
#include "geometry/io/container/npz.h"
#include "geometry/error.h"
#include "tests/fuzz/fuzz_target.h"

// Reads every member and asks it for all that it may be asked for.
HOLDFAST_FUZZ_TARGET(npz) {
  using holdfast::fuzz::Require;
  const holdfast::NpzReader archive(trial.Bytes(), "arrays.npz");
  std::size_t read = 0;
  for (const std::string& key : archive.Keys()) {
    Require(archive.Has(key), "an archive has what it lists");
    try {
      const holdfast::NpyMember member = archive.Read(key);
      const holdfast::NpyArray& array = member.array;
      Require(array.data.size() == array.NumElements() * array.item_size,
              "an array holds as many bytes as its shape says");
      ++read;
      if (array.kind == 'U' || array.kind == 'S') {
        if (array.NumElements() == 1) member.AsText();
        continue;
      }
      Require(member.AsDoubles().size() == array.NumElements(), "one number per element");
      Require(member.AsFloats().size() == array.NumElements(), "one number per element");
      member.AsIntegers();
    } catch (const holdfast::Error&) {
      // One bad member does not spoil the others.
    }
  }
  if (read == 0) throw holdfast::Error("arrays.npz", "no member could be read", "Fuzz on");
  trial.Accept();
}
