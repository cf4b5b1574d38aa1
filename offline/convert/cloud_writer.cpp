#include "cloud_writer.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <cmath>
#include <cstring>
#include <iterator>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "offline/io/files/error.h"
#include "offline/io/files/output_file.h"
#include "offline/io/map_folder/map_writer.h"
#include "offline/io/scans/las_layout.h"

namespace alces::offline {
namespace {

static_assert(std::endian::native == std::endian::little, "numbers are written as they lie in memory");

template <typename T>
void append_binary(std::string& bytes, T value) {
  std::array<char, sizeof(T)> raw{};
  std::memcpy(raw.data(), &value, sizeof(T));
  bytes.append(raw.data(), raw.size());
}

void append_xyz(std::string& bytes, const Point& point) {
  append_binary(bytes, point.x);
  append_binary(bytes, point.y);
  append_binary(bytes, point.z);
}

using Origin = std::array<double, 3>;

void append_xyz_from(std::string& bytes, const Point& point, const Origin& origin_m) {
  append_binary(bytes, static_cast<double>(point.x) + origin_m[0]);
  append_binary(bytes, static_cast<double>(point.y) + origin_m[1]);
  append_binary(bytes, static_cast<double>(point.z) + origin_m[2]);
}

// The count is known last: room for any 64-bit number, filled up with blanks in front.
std::string padded_count(std::uint64_t count) {
  return fmt::format("{:>20}", count);
}

/// What all forms share: a buffer of the points of one call, and the file.
class FileCloudWriter : public CloudWriter {
 public:
  explicit FileCloudWriter(const std::filesystem::path& file) : output_(file) {}
  void finish() override { output_.commit(); }

 protected:
  void flush() override {
    output_.write(bytes_);
    bytes_.clear();
  }

  OutputFile output_;
  std::string bytes_;
};

/// In the form of the map folder's map.ply.
class PlyWriter final : public CloudWriter {
 public:
  PlyWriter(const std::filesystem::path& file, bool has_intensity)
      : output_(file, has_intensity ? PlyMapWriter::Attribute::scan_and_intensity
                                    : PlyMapWriter::Attribute::scan) {}
  void finish() override { output_.finish(); }

 protected:
  void write(const Point& point, std::uint32_t scan, double, std::uint8_t intensity) override {
    points_.push_back(point);
    intensity_.push_back(intensity);
    scan_ = scan;
  }
  void flush() override {
    output_.add(points_, Pose{}, scan_, intensity_);
    points_.clear();
    intensity_.clear();
  }

 private:
  PlyMapWriter output_;
  std::vector<Point> points_;
  std::vector<std::uint8_t> intensity_;
  std::uint32_t scan_ = 0;
};

/// In doubles, from an origin on.
class FarPlyWriter final : public FileCloudWriter {
 public:
  FarPlyWriter(const std::filesystem::path& file, const Origin& origin_m, bool has_intensity)
      : FileCloudWriter(file), origin_m_(origin_m), has_intensity_(has_intensity) {
    std::string header =
        "ply\nformat binary_little_endian 1.0\ncomment written by alces\n"
        "comment right-handed, x forward, y left, z up, metres\nelement vertex ";
    count_at_ = header.size();
    header +=
        padded_count(0) + "\nproperty double x\nproperty double y\nproperty double z\nproperty uint scan\n";
    header += has_intensity_ ? "property uchar intensity\nend_header\n" : "end_header\n";
    output_.write(header);
  }
  void finish() override {
    output_.patch(count_at_, padded_count(written()));
    FileCloudWriter::finish();
  }

 protected:
  void write(const Point& point, std::uint32_t scan, double, std::uint8_t intensity) override {
    append_xyz_from(bytes_, point, origin_m_);
    append_binary(bytes_, scan);
    if (has_intensity_) append_binary(bytes_, intensity);
  }

 private:
  Origin origin_m_;
  bool has_intensity_;
  std::uint64_t count_at_ = 0;
};

class PcdWriter final : public FileCloudWriter {
 public:
  PcdWriter(const std::filesystem::path& file, const Origin& origin_m, bool has_intensity)
      : FileCloudWriter(file),
        origin_m_(origin_m),
        is_far_(origin_m != Origin{}),
        has_intensity_(has_intensity) {
    std::string header = fmt::format(
        "# .PCD v0.7 - Point Cloud Data file format, written by alces: right-handed, z up, metres\n"
        "VERSION 0.7\nFIELDS x y z scan{1}\nSIZE {0} {0} {0} 4{2}\nTYPE F F F U{3}\nCOUNT 1 1 1 1{4}\nWIDTH ",
        is_far_ ? 8 : 4, has_intensity_ ? " intensity" : "", has_intensity_ ? " 4" : "",
        has_intensity_ ? " F" : "", has_intensity_ ? " 1" : "");
    width_at_ = header.size();
    header += padded_count(0) + "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS ";
    points_at_ = header.size();
    header += padded_count(0) + "\nDATA binary\n";
    output_.write(header);
  }
  void finish() override {
    output_.patch(width_at_, padded_count(written()));
    output_.patch(points_at_, padded_count(written()));
    FileCloudWriter::finish();
  }

 protected:
  void write(const Point& point, std::uint32_t scan, double, std::uint8_t intensity) override {
    if (is_far_)
      append_xyz_from(bytes_, point, origin_m_);
    else
      append_xyz(bytes_, point);
    append_binary(bytes_, scan);
    if (has_intensity_) append_binary(bytes_, static_cast<float>(intensity));  // as PCL's PointXYZI
  }

 private:
  Origin origin_m_;
  bool is_far_;
  bool has_intensity_;
  std::uint64_t width_at_ = 0;
  std::uint64_t points_at_ = 0;
};

class LasWriter final : public FileCloudWriter {
 public:
  LasWriter(const std::filesystem::path& file, const Origin& origin_m)
      : FileCloudWriter(file), file_(file), origin_m_(origin_m) {
    output_.write(header());
  }
  void finish() override {
    output_.patch(0, header());
    FileCloudWriter::finish();
  }

 protected:
  void write(const Point& point, std::uint32_t scan, double stamp_s, std::uint8_t intensity) override {
    const std::array<float, 3> xyz = {point.x, point.y, point.z};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double steps = std::round(static_cast<double>(xyz.at(axis)) / las::step_m);
      if (std::abs(steps) > std::numeric_limits<std::int32_t>::max()) {
        throw OutputError(file_,
                          fmt::format("a coordinate of {} m is beyond what LAS holds in steps of 0.1 mm; "
                                      "write PLY instead",
                                      xyz.at(axis)));
      }
      const double value_m = steps * las::step_m;
      least_m_.at(axis) = count_ == 0 ? value_m : std::min(least_m_.at(axis), value_m);
      most_m_.at(axis) = count_ == 0 ? value_m : std::max(most_m_.at(axis), value_m);
      append_binary(bytes_, static_cast<std::int32_t>(steps));
    }
    ++count_;
    append_binary(bytes_, static_cast<std::uint16_t>(257 * intensity));  // of 16 bits
    append_binary(bytes_, std::uint8_t{0x11});                           // return 1 of 1
    append_binary(bytes_, std::uint8_t{0});                              // flags
    append_binary(bytes_, std::uint8_t{0});                              // never classified
    append_binary(bytes_, std::uint8_t{0});                              // user data
    append_binary(bytes_, std::int16_t{0});                              // scan angle
    append_binary(bytes_, static_cast<std::uint16_t>(scan & 0xffff));    // point source
    append_binary(bytes_, stamp_s);
  }

 private:
  [[nodiscard]] std::string header() const {
    std::string h = "LASF";
    append_binary(h, std::uint16_t{0});          // file source
    append_binary(h, las::global_encoding_wkt);  // required of point formats from 6 on
    h.append(16, '\0');                          // project ID
    append_binary(h, std::uint8_t{1});
    append_binary(h, std::uint8_t{4});  // LAS 1.4
    append_padded(h, "alces", 32);
    append_padded(h, "alces convert", 32);
    append_binary(h, std::uint16_t{0});  // day and year: the same input gives the same file
    append_binary(h, std::uint16_t{0});
    append_binary(h, las::header_bytes);
    append_binary(h, std::uint32_t{las::header_bytes});  // points follow at once
    append_binary(h, std::uint32_t{0});                  // no variable length records
    append_binary(h, std::uint8_t{6});
    append_binary(h, las::record_bytes_6);
    append_binary(h, std::uint32_t{0});  // legacy counts: not for this format
    for (int i = 0; i < 5; ++i) append_binary(h, std::uint32_t{0});
    for (int axis = 0; axis < 3; ++axis) append_binary(h, las::step_m);
    for (const double offset_m : origin_m_) append_binary(h, offset_m);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      append_binary(h, most_m_.at(axis) + origin_m_.at(axis));
      append_binary(h, least_m_.at(axis) + origin_m_.at(axis));
    }
    append_binary(h, std::uint64_t{0});  // waveforms
    append_binary(h, std::uint64_t{0});  // extended variable length records
    append_binary(h, std::uint32_t{0});
    append_binary(h, count_);
    append_binary(h, count_);  // first returns
    for (int i = 1; i < 15; ++i) append_binary(h, std::uint64_t{0});
    return h;
  }

  static void append_padded(std::string& bytes, std::string_view text, std::size_t size) {
    bytes += text;
    bytes.append(size - text.size(), '\0');
  }

  std::filesystem::path file_;
  Origin origin_m_;
  std::uint64_t count_ = 0;
  std::array<double, 3> least_m_{};
  std::array<double, 3> most_m_{};
};

class CsvWriter final : public FileCloudWriter {
 public:
  CsvWriter(const std::filesystem::path& file, const Origin& origin_m, bool has_intensity)
      : FileCloudWriter(file),
        origin_m_(origin_m),
        is_far_(origin_m != Origin{}),
        has_intensity_(has_intensity) {
    output_.write(has_intensity_ ? "x,y,z,scan,intensity\n" : "x,y,z,scan\n");
  }

 protected:
  void write(const Point& point, std::uint32_t scan, double, std::uint8_t intensity) override {
    if (is_far_)
      fmt::format_to(std::back_inserter(bytes_), "{:.4f},{:.4f},{:.4f},{}",
                     static_cast<double>(point.x) + origin_m_[0], static_cast<double>(point.y) + origin_m_[1],
                     static_cast<double>(point.z) + origin_m_[2], scan);
    else
      fmt::format_to(std::back_inserter(bytes_), "{},{},{},{}", point.x, point.y, point.z, scan);
    if (has_intensity_) fmt::format_to(std::back_inserter(bytes_), ",{}", intensity);
    bytes_.push_back('\n');
  }

 private:
  Origin origin_m_;
  bool is_far_;
  bool has_intensity_;
};

class KittiWriter final : public FileCloudWriter {
 public:
  using FileCloudWriter::FileCloudWriter;

 protected:
  void write(const Point& point, std::uint32_t, double, std::uint8_t intensity) override {
    append_xyz(bytes_, point);
    append_binary(bytes_, static_cast<float>(intensity) / 255.0F);
  }
};

}  // namespace

std::optional<CloudForm> cloud_form_of(const std::filesystem::path& file) {
  std::string extension = file.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  using Known = std::pair<std::string_view, CloudForm>;
  for (const auto& [name, form] :
       {Known{".ply", CloudForm::ply}, Known{".pcd", CloudForm::pcd}, Known{".las", CloudForm::las},
        Known{".csv", CloudForm::csv}, Known{".xyz", CloudForm::csv}, Known{".bin", CloudForm::kitti}}) {
    if (extension == name) return form;
  }
  return std::nullopt;
}

void CloudWriter::add(std::span<const Point> points, std::uint32_t scan, double stamp_s,
                      std::span<const std::uint8_t> intensity) {
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!is_finite(points[i])) {
      ++not_finite_;
      continue;
    }
    write(points[i], scan, stamp_s, i < intensity.size() ? intensity[i] : std::uint8_t{0});
    ++written_;
  }
  flush();
}

std::unique_ptr<CloudWriter> open_cloud_writer(const std::filesystem::path& file, CloudForm form,
                                               const Origin& origin_m, bool has_intensity) {
  switch (form) {
    case CloudForm::ply:
      if (origin_m != Origin{}) return std::make_unique<FarPlyWriter>(file, origin_m, has_intensity);
      return std::make_unique<PlyWriter>(file, has_intensity);
    case CloudForm::pcd:
      return std::make_unique<PcdWriter>(file, origin_m, has_intensity);
    case CloudForm::las:
      return std::make_unique<LasWriter>(file, origin_m);
    case CloudForm::csv:
      return std::make_unique<CsvWriter>(file, origin_m, has_intensity);
    case CloudForm::kitti:
      break;
  }
  return std::make_unique<KittiWriter>(file);
}

}  // namespace alces::offline
