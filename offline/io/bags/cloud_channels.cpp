#include "cloud_channels.h"

#include <array>
#include <string_view>
#include <vector>

namespace alces::offline {
namespace {

/// Of PointField's types 1 to 8.
constexpr std::array<NumberType, 8> types = {NumberType::i8,  NumberType::u8,  NumberType::i16,
                                             NumberType::u16, NumberType::i32, NumberType::u32,
                                             NumberType::f32, NumberType::f64};

bool is_number(const bags::PointField& field) {
  return field.type >= 1 && field.type <= types.size();
}

RawChannel channel_of(const bags::PointCloud2& cloud, std::size_t place) {
  RawChannel channel;
  if (place >= cloud.fields.size()) return channel;
  const bags::PointField& field = cloud.fields[place];
  channel.name = field.name;
  channel.type = types.at(field.type - 1U);
  bags::read_values(cloud, field, channel.values);
  return channel;
}

}  // namespace

RawChannels channels_of(const bags::PointCloud2& cloud) {
  std::vector<std::string_view> names;
  for (const bags::PointField& field : cloud.fields)
    names.push_back(is_number(field) ? std::string_view(field.name) : std::string_view());
  const ChannelFields fields = find_channels(names);
  return {channel_of(cloud, fields.time), channel_of(cloud, fields.intensity)};
}

}  // namespace alces::offline
