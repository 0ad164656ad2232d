#include "video_file.h"

#include <cstdint>
#include <fstream>
#include <initializer_list>

namespace slender {

namespace {

/// A file that is read from any place. good() is false once something beyond its end was asked for.
class Bytes
{
public:
  explicit Bytes(const std::string& path) : file_(path, std::ios::binary | std::ios::ate)
  {
    size_ = file_ ? static_cast<std::uint64_t>(file_.tellg()) : 0;
  }

  std::uint64_t size() const { return size_; }
  bool good() const { return good_; }
  /// The text of `count` bytes at `at`.
  std::string text(std::uint64_t at, std::size_t count)
  {
    std::string bytes(count, '\0');
    file_.seekg(static_cast<std::streamoff>(at));
    good_ = good_ && static_cast<bool>(file_.read(bytes.data(), static_cast<std::streamsize>(count)));
    return bytes;
  }
  /// The number in `count` bytes at `at`, the greatest byte first.
  std::uint64_t number(std::uint64_t at, std::size_t count)
  {
    std::uint64_t value = 0;
    for (const char byte : text(at, count))
      value = value << 8 | static_cast<unsigned char>(byte);
    return value;
  }

private:
  std::ifstream file_;
  std::uint64_t size_ = 0;
  bool good_ = true;
};

/// Part of an mp4 file: what a box (ISO/IEC 14496-12) holds, from `begin` to `end`.
struct Span
{
  std::uint64_t begin = 0, end = 0;
};

/// Finds the first box of this type in `outer`. Returns false if there is none or if the boxes do not fill `outer`
/// exactly.
bool findBox(Bytes& file, const Span& outer, const std::string& type, Span& found)
{
  bool any = false;
  std::uint64_t at = outer.begin;
  while (at < outer.end)
  {
    std::uint64_t length = file.number(at, 4), head = 8;
    const std::string own_type = file.text(at + 4, 4);
    if (length == 1)   // the length does not fit into four bytes
    {
      length = file.number(at + 8, 8);
      head = 16;
    }
    if (!file.good() || length < head || length > outer.end - at)
      return false;
    if (own_type == type && !any)
    {
      found = {at + head, at + length};
      any = true;
    }
    at += length;
  }
  return any;
}

long picturesInMp4(Bytes& file)
{
  Span box{0, file.size()}, data;
  if (!findBox(file, box, "mdat", data))
    return 0;
  for (const char* type : {"moov", "trak", "mdia", "minf", "stbl", "stsz"})
    if (!findBox(file, Span(box), type, box))
      return 0;
  const long count = static_cast<long>(file.number(box.begin + 8, 4));   // behind the version and the common size
  return file.good() ? count : 0;
}

/// Counts images up to the trailer (GIF89a specification).
long picturesInGif(Bytes& file)
{
  constexpr std::uint64_t extension = 0x21, image = 0x2c, trailer = 0x3b;
  // [bytes] of colours
  const auto table = [](std::uint64_t flags) -> std::uint64_t { return flags & 0x80 ? 3u << ((flags & 7) + 1) : 0; };
  std::uint64_t at = 13 + table(file.number(10, 1));
  for (long count = 0; file.good();)
  {
    const std::uint64_t kind = file.number(at, 1);
    if (kind == trailer)
      return file.good() ? count : 0;
    if (kind == image)
    {
      ++count;
      at += 11 + table(file.number(at + 9, 1));   // descriptor, colours, code size
    }
    else if (kind == extension)
      at += 2;
    else
      return 0;
    while (const std::uint64_t length = file.number(at, 1))   // blocks of data, the last one empty
    {
      at += 1 + length;
      if (!file.good())
        return 0;
    }
    at += 1;
  }
  return 0;
}

}   // namespace

long picturesIn(const std::string& path)
{
  Bytes file(path);
  return file.size() > 6 && file.text(0, 3) == "GIF" ? picturesInGif(file) : picturesInMp4(file);
}

}   // namespace slender
