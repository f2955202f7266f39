#include "io/section_file.hpp"

#include <zstd.h>

#include <algorithm>
#include <memory>

#include "core/base/check.hpp"
#include "io/atomic_file.hpp"
#include "io/bytes.hpp"
#include "io/text.hpp"

namespace lichthof::io {

namespace {

constexpr std::size_t name_bytes = 8, head_bytes = 8 + 4 + 4 + 8 + 8, entry_bytes = name_bytes + 4 * 8;
constexpr std::uint32_t most_sections = 64;
constexpr std::uint64_t largest_file = 1ull << 36;
constexpr int compression_level = 3;

Expected<std::string> compressed(const std::string& path, std::string_view raw) {
  const std::unique_ptr<ZSTD_CCtx, decltype(&ZSTD_freeCCtx)> context(ZSTD_createCCtx(), &ZSTD_freeCCtx);
  MUST(context != nullptr);
  ZSTD_CCtx_setParameter(context.get(), ZSTD_c_compressionLevel, compression_level);
  ZSTD_CCtx_setParameter(context.get(), ZSTD_c_checksumFlag, 1);
  std::string stored(ZSTD_compressBound(raw.size()), '\0');
  const std::size_t size = ZSTD_compress2(context.get(), stored.data(), stored.size(), raw.data(), raw.size());
  if (ZSTD_isError(size))
    return Error{ErrorCode::failed, path, std::string("cannot be compressed: ") + ZSTD_getErrorName(size)};
  stored.resize(size);
  return stored;
}

}  // namespace

Status write_sections(const std::string& path, const SectionFormat& format, const Sections& sections) {
  MUST(format.magic.size() == 8 && sections.size() <= most_sections);
  std::vector<std::string> stored;
  for (const auto& [name, raw] : sections) {
    Expected<std::string> bytes = compressed(path, raw);
    if (!bytes) return bytes.error();
    stored.push_back(std::move(*bytes));
  }
  ByteWriter table;
  std::uint64_t offset = head_bytes + entry_bytes * sections.size();
  for (std::size_t i = 0; i < sections.size(); ++i) {
    MUST(sections[i].first.size() <= name_bytes);
    std::string name = sections[i].first;
    name.resize(name_bytes, '\0');
    for (const char c : name) table.put(c);
    table.put(offset);
    table.put(static_cast<std::uint64_t>(stored[i].size()));
    table.put(static_cast<std::uint64_t>(sections[i].second.size()));
    table.put(checksum(stored[i]));
    offset += stored[i].size();
  }
  ByteWriter head;
  for (const char c : format.magic) head.put(c);
  head.put(format.version);
  head.put(static_cast<std::uint32_t>(sections.size()));
  head.put(offset);
  head.put(checksum(table.bytes(), checksum(head.bytes())));

  Expected<AtomicFile> file = AtomicFile::create(path);
  if (!file) return file.error();
  Status written = file->append(head.bytes());
  if (written) written = file->append(table.bytes());
  for (std::size_t i = 0; i < stored.size() && written; ++i) written = file->append(stored[i]);
  return written ? file->commit() : written;
}

Expected<SectionFile> SectionFile::open(const std::string& path, const SectionFormat& format) {
  Expected<std::string> bytes = file_bytes(path, largest_file);
  if (!bytes) return bytes.error();
  SectionFile file;
  file.path_ = path;
  file.kind_ = std::string(format.kind);
  file.bytes_ = std::move(*bytes);
  const std::string_view all = file.bytes_;
  const auto wrong = [&](const std::string& what) { return bad_input(path, what); };
  if (!all.starts_with(format.magic)) return wrong("is no " + file.kind_);
  const auto truncated = [&](std::uint64_t expected) {
    return wrong("is a truncated " + file.kind_ + ": " + std::to_string(all.size()) + " of " +
                 std::to_string(expected) + " bytes");
  };
  if (all.size() < head_bytes) return truncated(head_bytes);
  ByteReader head(all.substr(8, head_bytes - 8));
  std::uint32_t version = 0, count = 0;
  std::uint64_t size = 0, check = 0;
  head.get(version), head.get(count), head.get(size), head.get(check);
  if (version != format.version)
    return wrong("is a " + file.kind_ + " of format " + std::to_string(version) + "; this program reads format " +
                 std::to_string(format.version));
  if (count > most_sections) return wrong("is damaged: its header makes no sense");
  if (all.size() < size || all.size() < head_bytes + entry_bytes * count) return truncated(size);
  const std::string_view table = all.substr(head_bytes, entry_bytes * count);
  if (all.size() > size || checksum(table, checksum(all.substr(0, head_bytes - 8))) != check)
    return wrong("is damaged: the checksum of its header is wrong");

  ByteReader reader(table);
  for (std::uint32_t i = 0; i < count; ++i) {
    Entry entry;
    char name[name_bytes];
    reader.get(name), reader.get(entry.offset), reader.get(entry.stored), reader.get(entry.raw),
        reader.get(entry.check);
    entry.name.assign(name, static_cast<std::size_t>(std::find(name, name + name_bytes, '\0') - name));
    if (entry.offset > size || entry.stored > size - entry.offset)
      return wrong("is damaged: a section lies outside the file");
    if (checksum(all.substr(entry.offset, entry.stored)) != entry.check)
      return wrong("is damaged: the checksum of section " + in_quotes(entry.name) + " is wrong");
    file.table_.push_back(std::move(entry));
  }
  return file;
}

Expected<std::string> SectionFile::section(std::string_view name, std::uint64_t most_bytes) const {
  const auto entry = std::find_if(table_.begin(), table_.end(), [name](const Entry& e) { return e.name == name; });
  const std::string section = "section " + in_quotes(name);
  if (entry == table_.end()) return bad_input(path_, "is damaged: it has no " + section);
  if (entry->raw > most_bytes) return bad_input(path_, "is damaged: " + section + " is larger than it can be");

  const std::unique_ptr<ZSTD_DCtx, decltype(&ZSTD_freeDCtx)> context(ZSTD_createDCtx(), &ZSTD_freeDCtx);
  MUST(context != nullptr);
  // Grown as the bytes come: a short frame that claims gigabytes does not get them for the asking.
  std::string raw, chunk(1 << 20, '\0');
  ZSTD_inBuffer input{bytes_.data() + entry->offset, entry->stored, 0};
  for (;;) {
    ZSTD_outBuffer output{chunk.data(), chunk.size(), 0};
    const std::size_t left = ZSTD_decompressStream(context.get(), &output, &input);
    const bool stuck = left != 0 && input.pos == input.size && output.pos == 0;
    if (ZSTD_isError(left) || stuck || raw.size() + output.pos > entry->raw)
      return bad_input(path_, "is damaged: " + section + " cannot be decompressed");
    raw.append(chunk.data(), output.pos);
    if (left == 0) break;
  }
  if (raw.size() != entry->raw || input.pos != input.size)
    return bad_input(path_, "is damaged: " + section + " has another length than its table says");
  return raw;
}

}  // namespace lichthof::io
