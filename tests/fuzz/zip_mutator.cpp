// SPDX-License-Identifier: MIT
#include <zip.h>
#include <zlib.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <random>
#include <string>
#include <vector>

#include "geometry/error.h"
#include "geometry/io/container/npy_header.h"

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t max_size);

// Bytes changed anywhere in a zip archive break its checksums and offsets, and hardly anything
// behind those would ever be reached. So most mutations unpack the archive, change one member and
// pack it again; the rest are those of libFuzzer, for the archive's own structures.
namespace {

constexpr std::size_t kMaxArray = 1 << 12;

struct Member {
  std::string name;
  std::string data;
};

using Random = std::minstd_rand;

bool OneIn(Random& random, unsigned n) { return random() % n == 0; }

std::vector<Member> Unpack(const std::uint8_t* data, std::size_t size) {
  std::vector<Member> members;
  zip_error_t error;
  zip_error_init(&error);
  zip_source_t* source = zip_source_buffer_create(data, size, 0, &error);
  zip_t* zip = source == nullptr ? nullptr : zip_open_from_source(source, ZIP_RDONLY, &error);
  zip_error_fini(&error);
  if (zip == nullptr) {
    if (source != nullptr) zip_source_free(source);
    return members;
  }
  for (zip_uint64_t i = 0; i < static_cast<zip_uint64_t>(zip_get_num_entries(zip, 0)); ++i) {
    const char* name = zip_get_name(zip, i, ZIP_FL_ENC_RAW);
    zip_file_t* file = zip_fopen_index(zip, i, 0);
    zip_stat_t stat;
    if (name != nullptr && file != nullptr && zip_stat_index(zip, i, 0, &stat) == 0) {
      Member member{name, std::string(std::min<zip_uint64_t>(stat.size, 1 << 14), '\0')};
      // What a wrong checksum spoils at the end is taken up to there.
      const zip_int64_t count = zip_fread(file, member.data.data(), member.data.size());
      member.data.resize(count > 0 ? static_cast<std::size_t>(count) : 0);
      members.push_back(std::move(member));
    }
    if (file != nullptr) zip_fclose(file);
  }
  zip_discard(zip);
  return members;
}

template <typename... Field>
void Put(std::string& out, Field... field) {
  const auto put = [&](auto value) {
    out.append(reinterpret_cast<const char*>(&value), sizeof value);
  };
  (put(field), ...);
}

std::string Deflated(const std::string& data) {
  std::string packed(compressBound(data.size()), '\0');
  z_stream stream{};
  deflateInit2(&stream, 6, Z_DEFLATED, -15, 8, Z_DEFAULT_STRATEGY);
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(data.data()));
  stream.avail_in = static_cast<uInt>(data.size());
  stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_out = static_cast<uInt>(packed.size());
  deflate(&stream, Z_FINISH);
  packed.resize(stream.total_out);
  deflateEnd(&stream);
  return packed;
}

std::string Pack(const std::vector<Member>& members, bool deflated) {
  std::string out;
  std::string directory;
  for (const Member& member : members) {
    const std::string content = deflated ? Deflated(member.data) : member.data;
    const auto offset = static_cast<std::uint32_t>(out.size());
    std::string common;  // what local and central headers share: version .. extra length
    Put(common, std::uint16_t{20}, std::uint16_t{0}, std::uint16_t(deflated ? 8 : 0),
        std::uint16_t{0}, std::uint16_t{33},
        std::uint32_t(crc32(0, reinterpret_cast<const Bytef*>(member.data.data()),
                            static_cast<uInt>(member.data.size()))),
        std::uint32_t(content.size()), std::uint32_t(member.data.size()),
        std::uint16_t(member.name.size()), std::uint16_t{0});
    out += "PK\x03\x04" + common + member.name + content;
    directory += "PK\x01\x02";
    Put(directory, std::uint16_t{20});
    directory += common;
    Put(directory, std::uint16_t{0}, std::uint16_t{0}, std::uint16_t{0}, std::uint32_t{0}, offset);
    directory += member.name;
  }
  const auto begin = static_cast<std::uint32_t>(out.size());
  out += directory + "PK\x05\x06";
  const auto count = static_cast<std::uint16_t>(members.size());
  Put(out, std::uint32_t{0}, count, count, std::uint32_t(directory.size()), begin,
      std::uint16_t{0});
  return out;
}

void Mutate(std::string& text, std::size_t growth) {
  const std::size_t size = text.size();
  text.resize(size + growth);
  text.resize(LLVMFuzzerMutate(reinterpret_cast<std::uint8_t*>(text.data()), size, text.size()));
}

// Gives a .npy member whose header can be read the bytes that its header asks for.
void FitNpyData(std::string& npy) {
  if (!npy.starts_with(holdfast::kNpyMagic) || npy.size() < 12 || npy[6] != 1) return;
  const std::size_t end = npy.find('\n', 10);
  if (end == std::string::npos || end > 65000) return;
  npy[8] = static_cast<char>((end - 9) & 0xff);
  npy[9] = static_cast<char>((end - 9) >> 8);
  try {
    const auto header =
        holdfast::ParseNpyHeader(std::string_view(npy).substr(10, end - 9), "mutant");
    std::size_t bytes = header.item_size;
    for (const std::size_t n : header.shape) {
      if (n > kMaxArray || (bytes *= n) > kMaxArray) return;
    }
    npy.resize(end + 1 + bytes, '\x3f');
  } catch (const holdfast::Error&) {
    return;
  }
}

void MutateMembers(std::vector<Member>& members, std::size_t room, Random& random) {
  Member& member = members[random() % members.size()];
  Member& other = members[random() % members.size()];
  switch (random() % 16) {
    case 0:
      Mutate(member.name, 8);
      if (member.name.empty()) member.name = "a";
      break;
    case 1:
      std::swap(member.data, other.data);
      break;
    case 2:
      member.data = other.data;
      break;
    case 3:
      if (members.size() > 1) {
        members.erase(members.begin() + (&member - members.data()));
      } else {
        members.push_back(Member(member));
      }
      break;
    default:
      Mutate(member.data, std::min<std::size_t>(room, 256));
      if (!OneIn(random, 4)) FitNpyData(member.data);
  }
}

}  // namespace

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size,
                                               std::size_t max_size, unsigned seed) {
  Random random(seed);
  std::vector<Member> members;
  if (!OneIn(random, 8)) members = Unpack(data, size);
  if (members.empty()) return LLVMFuzzerMutate(data, size, max_size);
  MutateMembers(members, size < max_size ? max_size - size : 0, random);
  const std::string packed = Pack(members, OneIn(random, 8));
  if (packed.size() > max_size) return LLVMFuzzerMutate(data, size, max_size);
  std::memcpy(data, packed.data(), packed.size());
  return packed.size();
}
