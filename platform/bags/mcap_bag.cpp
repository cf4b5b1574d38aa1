#include <cstring>
#include <map>
#include <optional>
#include <system_error>

#include "alces_platform/recording/mcap_reader.h"
#include "bag_files.h"
#include "zstd_source.h"

namespace alces::bags {
namespace {

class McapBag final : public BagReader {
 public:
  McapBag(const std::filesystem::path& file, const Topics& topics)
      : file_(file), topics_(topics), total_bytes_(size_of(file)), disk_(file.c_str()), mcap_(source()) {
    if (!disk_.is_open())
      throw BagError(file, std::string("cannot be opened (") + std::strerror(disk_.error_number()) + ")");
    if (!mcap_.open()) throw BagError(file, mcap_.problems().front());
  }

  bool next(Message& message) override {
    mcap::ReadMessage read;
    while (mcap_.next(read)) {
      const std::size_t channel = place_of(read.channel);
      if (!is_asked_for(topics_, channels_[channel].topic)) continue;
      message = {channel, sane_ns(read.log_time_ns), read.data};
      return true;
    }
    if (mcap_.read_error() != 0)
      throw BagError(file_, std::string("cannot be read to its end (") + std::strerror(mcap_.read_error()) +
                                "); check the disk");
    for (; told_ < mcap_.problems().size(); ++told_) problem(file_, mcap_.problems()[told_]);
    return false;
  }

  [[nodiscard]] const std::vector<Channel>& channels() const override { return channels_; }
  [[nodiscard]] std::string title() const override {
    return mcap_.profile() == "ros1" ? "MCAP of ROS 1" : "MCAP";
  }
  [[nodiscard]] std::uint64_t bytes_read() const override {
    return unpacking_ ? unpacking_->packed_bytes_read() : mcap_.counters().bytes;
  }
  [[nodiscard]] std::uint64_t total_bytes() const override { return total_bytes_; }

 private:
  ByteSource& source() {
    if (file_.extension() != ".zstd" && file_.extension() != ".zst") return disk_;
    return unpacking_.emplace(disk_);
  }

  std::size_t place_of(std::uint16_t id) {
    const auto [found, is_new] = places_.try_emplace(id, channels_.size());
    if (!is_new) return found->second;
    const mcap::ReadChannel& read = mcap_.channels().at(id);
    Channel channel = {read.topic,
                       plain_type(read.schema),
                       encoding_called(read.message_encoding),
                       read.message_encoding,
                       {}};
    for (const auto& [schema_id, schema] : mcap_.schemas()) {
      const bool is_text = schema.encoding == "ros2msg" || schema.encoding == "ros1msg";
      if (schema.name == read.schema && is_text) channel.definition = schema.definition;
    }
    channels_.push_back(std::move(channel));
    return found->second;
  }

  std::filesystem::path file_;
  Topics topics_;
  std::uint64_t total_bytes_;
  FileSource disk_;
  std::optional<ZstdSource> unpacking_;
  mcap::Reader mcap_;
  std::map<std::uint16_t, std::size_t> places_;
  std::vector<Channel> channels_;
  std::size_t told_ = 0;
};

}  // namespace

std::unique_ptr<BagReader> open_mcap_bag(const std::filesystem::path& file, const Topics& topics) {
  return std::make_unique<McapBag>(file, topics);
}

}  // namespace alces::bags
