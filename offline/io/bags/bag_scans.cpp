#include "bag_scans.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <utility>

#include "alces_platform/bags/messages.h"
#include "alces_platform/bags/point_cloud.h"
#include "bag_choice.h"
#include "bag_odometry.h"
#include "bag_survey.h"
#include "offline/io/files/error.h"
#include "own_recording.h"
#include "profile_groups.h"

namespace alces::offline {
namespace {

namespace fs = std::filesystem;

bool is_identity(const Pose& pose) {
  return pose.translation_m == Eigen::Vector3d::Zero() && pose.rotation.coeffs() == Pose{}.rotation.coeffs();
}

void transform(std::vector<Point>& points, const Pose& pose) {
  const Eigen::Matrix3d rotation = pose.rotation.toRotationMatrix();
  for (Point& point : points) {
    const Eigen::Vector3d read = Eigen::Vector3f(point.x, point.y, point.z).cast<double>();
    const Eigen::Vector3f moved = (rotation * read + pose.translation_m).cast<float>();
    point = {moved.x(), moved.y(), moved.z()};
  }
}

constexpr float no_number = std::numeric_limits<float>::quiet_NaN();
constexpr Point nowhere = {no_number, no_number, no_number};

class BagScans final : public ScanSource {
 public:
  BagScans(const fs::path& bag, const ScanSourceOptions& options) : scale_(options.scale) {
    survey_ = survey_bag(bag, options.survey_progress);
    choice_ = choose_from_bag(survey_, options.bag, !options.no_odometry && !options.odometry);
    const SurveyedTopic& topic = BagScans::topic();
    reading_ = topic.channel_reading();
    context_ = topic.channel_context();  // of messages; a scan of profiles takes longer
    is_assembled_ = bags::is_profile_type(topic.channel.type);
    std::vector<std::string> grouping;
    if (is_assembled_) grouping = group_profiles(survey_, choice_);
    odometry_ = take_odometry(survey_, choice_, options);
    tell();
    warnings_.insert(warnings_.end(), grouping.begin(), grouping.end());
    // what is not needed any more
    for (SurveyedTopic& each : survey_.topics) {
      if (&each != &topic) each.scans = {};
      each.first_channels = {};
      each.first_points = {};
    }
  }

  [[nodiscard]] std::size_t size() const override { return topic().scans.size(); }

  bool read(std::size_t index, ScanPoints& scan) override {
    const SurveyedScan& wanted = topic().scans.at(index);
    try {
      if (!bag_ || ordinal_ > wanted.ordinal) {
        bag_ = bags::open_bag(survey_.path, {topic().channel.topic});
        ordinal_ = 0;
      }
      scan.clear();
      bags::Message message;
      while (bag_->next(message)) {
        // two channels may share a topic's name
        const bags::Channel& channel = bag_->channels()[message.channel];
        if (channel.type != topic().channel.type || channel.encoding != topic().channel.encoding) continue;
        const std::uint64_t ordinal = ordinal_++;
        if (ordinal < wanted.ordinal) continue;
        if (is_assembled_) {
          add_profile(channel, message, wanted, scan);
        } else {
          read_cloud(channel, message, wanted, scan);
        }
        if (ordinal == wanted.last_ordinal) return true;
      }
    } catch (const bags::BagError& error) {
      throw InputError(error.what());
    }
    throw InputError(survey_.path,
                     fmt::format("changed while it was read: {} is not there any more", name(index)));
  }

  [[nodiscard]] std::string name(std::size_t index) const override {
    return fmt::format("{} {}", topic().channel.topic, topic().scans.at(index).ordinal);
  }
  [[nodiscard]] std::size_t number(std::size_t index) const override { return index; }
  [[nodiscard]] std::optional<Pose> odometry(std::size_t index) const override {
    return odometry_.poses.empty() ? std::nullopt : odometry_.poses.at(index);
  }
  [[nodiscard]] std::optional<double> stamp_s(std::size_t index) const override {
    return stamp_in_s(topic().scans.at(index).stamp_ns);
  }
  [[nodiscard]] std::uint64_t file_bytes(std::size_t index) const override {
    return topic().scans.at(index).bytes;
  }
  [[nodiscard]] std::string description() const override {
    return fmt::format("{} {} of {} ({}), {}", size(), size() == 1 ? "scan" : "scans", topic().channel.topic,
                       survey_.title, odometry_.title);
  }
  [[nodiscard]] std::vector<std::string> warnings() const override {
    const std::scoped_lock lock(mutex_);
    return warnings_;
  }
  [[nodiscard]] std::optional<OdometryOrigin> odometry_origin() const override { return odometry_.origin; }

  /// The bag's odometry every hundredth of a second; without one, the poses of the scans around.
  [[nodiscard]] std::vector<TimedPose> motion(std::size_t index, double from_s, double to_s) const override {
    constexpr double step_s = 0.01;
    constexpr double longest_s = 10;
    std::vector<TimedPose> poses;
    const auto steps = static_cast<int>(std::ceil(std::clamp(to_s - from_s, 0.0, longest_s) / step_s));
    for (int i = 0; i <= steps; ++i) {
      const double time_s = from_s + step_s * i;
      if (const auto pose = odometry_at(survey_, choice_, std::llround(1e9 * time_s)))
        poses.push_back({time_s, *pose});
    }
    return poses.size() < 2 ? ScanSource::motion(index, from_s, to_s) : poses;
  }
  [[nodiscard]] std::string channels() const override {
    const std::scoped_lock lock(mutex_);
    return is_assembled_ ? reading_.intensity_text : reading_.text();  // a profile's times are used up
  }
  [[nodiscard]] bool has_intensity() const override {
    const std::scoped_lock lock(mutex_);
    return reading_.full_intensity > 0;
  }

 private:
  [[nodiscard]] const SurveyedTopic& topic() const { return survey_.topics[choice_.scans]; }

  void read_cloud(const bags::Channel& channel, const bags::Message& message, const SurveyedScan& wanted,
                  ScanPoints& scan) {
    const auto cloud = bags::read_cloud(channel, message.data, room_);
    if (!cloud || !bags::layout_problem(*cloud).empty())
      throw InputError(survey_.path, "changed while it was read; map it again");
    read_points(*cloud, wanted.stamp_ns, scan);
    const std::optional<Pose> mounting = body_from_scan(wanted);
    if (!mounting) {  // as many points, and none to be mapped: the scan is refused by name
      std::fill(scan.points.begin(), scan.points.end(), nowhere);
      warn_once(fmt::format("{} scans are left out: at their stamps /tf does not lead from {} to {}",
                            unplaced_, choice_.scans_frame, choice_.body_frame));
    } else if (!is_identity(*mounting)) {
      transform(scan.points, *mounting);
    }
  }

  void read_points(const bags::PointCloud2& cloud, std::int64_t stamp_ns, ScanPoints& scan) {
    bags::read_points(cloud, scan.points);
    take_channels_of(cloud, stamp_ns, scan);
    const auto scaled = [this](float read) { return static_cast<float>(static_cast<double>(read) * scale_); };
    for (Point& point : scan.points) {
      if (point.x == 0 && point.y == 0 && point.z == 0) point = nowhere;
      if (scale_ != 1) point = {scaled(point.x), scaled(point.y), scaled(point.z)};
    }
  }

  void take_channels_of(const bags::PointCloud2& cloud, std::int64_t stamp_ns, ScanPoints& scan) {
    scan.time_s.clear();
    scan.intensity.clear();
    scan.clock_s.reset();
    context_.stamp_s = stamp_in_s(stamp_ns);
    const std::scoped_lock lock(mutex_);
    take_channels(channels_of(cloud), context_, reading_, scan, warnings_);
    // in a bag a scan's stamp and its points' dates are of one clock, or one of them is wrong
    constexpr double farthest_s = 10;
    if (!scan.clock_s || std::abs(*scan.clock_s - *context_.stamp_s) <= farthest_s) return;
    const std::string sentence = fmt::format(
        "{}: the points' times are not used: some are more than {} s from the clouds' stamps, as of "
        "another clock",
        topic().channel.topic, farthest_s);
    scan.time_s.clear();
    scan.clock_s.reset();
    if (std::find(warnings_.begin(), warnings_.end(), sentence) == warnings_.end())
      warnings_.push_back(sentence);
  }

  /// A profile's rays, each where the head and the vehicle were at its time, in the body's frame at the
  /// scan's stamp. What does not decode, or has no place in /tf, was told when the bag was surveyed.
  void add_profile(const bags::Channel& channel, const bags::Message& message, const SurveyedScan& wanted,
                   ScanPoints& scan) {
    const auto cloud = bags::read_cloud(channel, message.data, room_);
    if (!cloud || !bags::layout_problem(*cloud).empty()) return;
    const std::int64_t begin_ns = stamp_or(cloud->header.stamp_ns, message.log_time_ns);
    read_points(*cloud, begin_ns, profile_);
    const double lasts_s = profile_.time_s.empty() ? 0 : static_cast<double>(profile_.time_s.back());
    const std::int64_t end_ns = begin_ns + std::llround(1e9 * lasts_s);
    const std::optional<Pose> at_begin = reference_from_laser(wanted.stamp_ns, begin_ns);
    if (!at_begin) return;
    const Pose at_end = reference_from_laser(wanted.stamp_ns, end_ns).value_or(*at_begin);
    for (std::size_t i = 0; i < profile_.points.size(); ++i) {
      const double fraction = static_cast<double>(i) / static_cast<double>(profile_.points.size());
      const Pose reference_from_ray = interpolate(*at_begin, at_end, fraction);
      const Point& read = profile_.points[i];
      const Eigen::Vector3f moved =
          (reference_from_ray * Eigen::Vector3f(read.x, read.y, read.z).cast<double>()).cast<float>();
      scan.points.push_back({moved.x(), moved.y(), moved.z()});
    }
    scan.intensity.insert(scan.intensity.end(), profile_.intensity.begin(), profile_.intensity.end());
    if (scan.intensity.size() != scan.points.size()) scan.intensity.clear();
  }

  /// Where the laser was at a time, in the body's frame at the scan's stamp; where the odometry does not say
  /// how the body moved in between, as if it had not.
  [[nodiscard]] std::optional<Pose> reference_from_laser(std::int64_t reference_ns,
                                                         std::int64_t stamp_ns) const {
    const auto body_from_laser = survey_.frames.between(choice_.body_frame, choice_.scans_frame, stamp_ns);
    const auto at_reference = odometry_at(survey_, choice_, reference_ns);
    const auto at_stamp = odometry_at(survey_, choice_, stamp_ns);
    if (!body_from_laser || !at_reference || !at_stamp) return body_from_laser;
    return at_reference->inverse() * *at_stamp * *body_from_laser;
  }

  /// None: not known at that time.
  [[nodiscard]] std::optional<Pose> body_from_scan(const SurveyedScan& scan) const {
    if (choice_.are_scans_registered) {
      const auto place = static_cast<std::size_t>(&scan - topic().scans.data());
      if (odometry_.poses.empty() || !odometry_.poses[place]) return std::nullopt;
      return odometry_.poses[place]->inverse();
    }
    if (!choice_.is_mounting_known || is_assembled_) return Pose{};
    return survey_.frames.between(choice_.body_frame, choice_.scans_frame, scan.stamp_ns);
  }

  void tell() {
    const SurveyedTopic& topic = BagScans::topic();
    const std::string& name = topic.channel.topic;
    warnings_ = survey_.problems;
    if (survey_.problem_count > survey_.problems.size())
      warn(fmt::format("{}: {} problems more", survey_.path.string(),
                       survey_.problem_count - survey_.problems.size()));
    for (const std::string& sentence : choice_.notes) warn(sentence);
    for (const std::string& sentence : choice_.warnings) warn(sentence);
    for (const std::string& sentence : odometry_.warnings) warn(sentence);
    if (topic.damaged > 0)
      warn(fmt::format("{}: {} of {} messages are left out: the first of them {}", name, topic.damaged,
                       topic.messages, topic.first_problem));
    if (topic.late > 0)
      warn(fmt::format("{}: {} scans are stamped no later than the one before and are left out", name,
                       topic.late));
    if (topic.without_stamp > 0)
      warn(fmt::format("{}: {} messages have no stamp; the time of recording is taken", name,
                       topic.without_stamp));
    if (reading_.time_unit_s == 0 && !reading_.time_text.empty() && !is_assembled_)
      warn(fmt::format("{}: {}", name, reading_.time_text));
    unplaced_ = 0;
    for (const SurveyedScan& scan : topic.scans) {
      if (!body_from_scan(scan)) ++unplaced_;
    }
  }
  void warn(const std::string& sentence) { warnings_.push_back(sentence); }
  /// A scan may be read more than once, and while others ask for the warnings.
  void warn_once(const std::string& sentence) {
    const std::scoped_lock lock(mutex_);
    if (std::find(warnings_.begin(), warnings_.end(), sentence) == warnings_.end())
      warnings_.push_back(sentence);
  }

  double scale_;
  BagSurvey survey_;
  BagChoice choice_;
  ChosenOdometry odometry_;
  ChannelReading reading_;
  ChannelContext context_;
  bool is_assembled_ = false;  ///< of profiles
  std::size_t unplaced_ = 0;
  std::vector<std::uint8_t> room_;
  ScanPoints profile_;
  std::unique_ptr<bags::BagReader> bag_;
  std::uint64_t ordinal_ = 0;  ///< of the topic's next message
  mutable std::mutex mutex_;
  std::vector<std::string> warnings_;
};

}  // namespace

std::unique_ptr<ScanSource> open_bag_scans(const fs::path& bag, const ScanSourceOptions& options) {
  if (!options.format.empty())
    throw UsageError(fmt::format(
        "--format {}: a bag says itself how its points are laid out; --topic names them", options.format));
  if (is_own_recording(bag))
    throw InputError(
        bag, fmt::format("is a recording of a drive: 'alces replay {} --out MAP' maps it", bag.string()));
  return std::make_unique<BagScans>(bag, options);
}

}  // namespace alces::offline
