// Where data lie on a model, and where else along a line they may: Icp's questions that move nothing.
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "alces/icp.h"
#include "geometry/float_transform.h"

namespace alces {

std::uint32_t Icp::gather_facing(std::span<const IcpScan> data, const Pose& model_from_data,
                                 const Eigen::Vector3d& direction, bool with_rough) {
  constexpr float facing = 0.7F;  // cosine of a plane's normal to the direction
  const FloatTransform data_to_model(model_from_data);
  const Point along{static_cast<float>(direction.x()), static_cast<float>(direction.y()),
                    static_cast<float>(direction.z())};
  const std::span<Sample> all = gather(data, samples_);
  const auto faces_along = [&](const Sample& sample) {
    return sample.plane_weight > 0 && std::abs(dot(data_to_model.rotate(sample.normal), along)) > facing;
  };
  std::size_t planes = 0;  // first, in their order
  for (Sample& sample : all)
    if (faces_along(sample)) std::swap(all[planes++], sample);
  std::size_t end = planes;
  for (Sample& sample : all.subspan(planes))
    if (with_rough && !(sample.plane_weight > 0)) std::swap(all[end++], sample);
  // Planes tell more: those without one get what room is left.
  std::uint32_t kept = 0;
  const auto downsample = [&](std::span<const Sample> some) {
    const std::size_t room = maximum_facing_samples - kept;
    if (some.empty() || room == 0) return;
    const std::size_t stride = (some.size() + room - 1) / room;
    for (std::size_t i = 0; i < some.size(); i += stride) all[kept++] = some[i];
  };
  downsample(all.first(planes));
  downsample(all.subspan(planes, end - planes));
  return kept;
}

bool Icp::is_fitting(const IcpScan& scan, const Sample& sample, const FloatTransform& body_from_data,
                     const IcpConfig& config) {
  constexpr float reach_m = 0.25F;  // about how far apart points of a surface are
  const Point place = body_from_data * sample.point;
  const Neighbor nearest = scan.tree->nearest(place, reach_m * reach_m);
  if (nearest.index == Neighbor::none) return false;
  const Point error_m = scan.tree->point(nearest.index) - place;
  const float off_m = sample.plane_weight > 0 ? dot(body_from_data.rotate(sample.normal), error_m)
                                              : std::sqrt(dot(error_m, error_m));
  return std::abs(off_m) < config.fit_distance_m;
}

std::uint32_t Icp::count_fitting(std::span<const IcpScan> model, std::span<const Sample> points,
                                 const Pose& model_from_data, const IcpConfig& config) {
  std::array<FloatTransform, maximum_model_scans> body_from_data;
  for (std::size_t m = 0; m < model.size(); ++m) {
    body_from_data[m] = FloatTransform(model[m].side_from_body.inverse() * model_from_data);
  }
  std::uint32_t fitting = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::size_t m = i % model.size();  // the model's scans in turn
    if (is_fitting(model[m], points[i], body_from_data[m], config)) ++fitting;
  }
  return fitting;
}

FacingFit Icp::facing_fit(std::span<const IcpScan> model, std::span<const IcpScan> data,
                          const Pose& model_from_data, const Eigen::Vector3d& direction,
                          const IcpConfig& config) {
  FacingFit fit;
  if (model.empty() || model.size() > maximum_model_scans) return fit;
  fit.samples = gather_facing(data, model_from_data, direction, false);
  fit.fitting = count_fitting(model, samples_.first(fit.samples), model_from_data, config);
  return fit;
}

std::uint32_t Icp::likely_shifts(std::span<const IcpScan> model, std::span<const IcpScan> data,
                                 const Pose& model_from_data, const Eigen::Vector3d& direction, double step_m,
                                 std::uint32_t steps, const IcpConfig& config, std::span<double> shifts_m) {
  if (model.empty() || model.size() > maximum_model_scans || steps > maximum_shift_steps) return 0;
  const std::span<const Sample> points =
      samples_.first(gather_facing(data, model_from_data, direction, false));
  std::array<std::uint32_t, 2 * maximum_shift_steps + 1> room{};
  const std::span<std::uint32_t> fitting = std::span(room).first(2 * std::size_t{steps} + 1);
  const auto shift_m = [&](std::size_t s) { return (static_cast<double>(s) - steps) * step_m; };
  for (std::size_t s = 0; s < fitting.size(); ++s) {
    Pose shifted = model_from_data;
    shifted.translation_m += shift_m(s) * direction;
    fitting[s] = count_fitting(model, points, shifted, config);
  }

  // A peak is as wide as a fit: what is beside it is the same place.
  const auto beside = static_cast<std::size_t>(static_cast<double>(config.fit_distance_m) / step_m);
  const auto around = [&](std::size_t s, std::size_t width) {
    const std::size_t begin = s - std::min(s, width);
    return fitting.subspan(begin, std::min(s + width + 1, fitting.size()) - begin);
  };
  const std::uint32_t here = *std::ranges::max_element(around(steps, beside));
  std::uint32_t found = 0;
  while (found < shifts_m.size()) {
    const auto best = std::ranges::max_element(fitting);
    if (*best <= here) break;
    const auto s = static_cast<std::size_t>(best - fitting.begin());
    shifts_m[found++] = shift_m(s);
    std::ranges::fill(around(s, 2 * beside + 1), 0);
  }
  return found;
}

bool Icp::is_held(std::span<const IcpScan> model, std::span<const IcpScan> data, const Pose& model_from_data,
                  const Eigen::Vector3d& direction, double least_m, double most_m, const IcpConfig& config) {
  if (model.empty() || model.size() > maximum_model_scans) return false;
  const double same_m = 3 * static_cast<double>(config.fit_distance_m);
  if (least_m > -same_m && most_m < same_m) return true;
  const std::span<const Sample> points =
      samples_.first(gather_facing(data, model_from_data, direction, true));
  std::array<FloatTransform, maximum_model_scans> body_from_data;
  const auto place = [&](double shift_m) {
    Pose shifted = model_from_data;
    shifted.translation_m += shift_m * direction;
    for (std::size_t m = 0; m < model.size(); ++m)
      body_from_data[m] = FloatTransform(model[m].side_from_body.inverse() * shifted);
  };
  std::array<bool, maximum_facing_samples> fits_here;
  place(0);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::size_t m = i % model.size();
    fits_here[i] = is_fitting(model[m], points[i], body_from_data[m], config);
  }
  // A fit is as wide as twice its distance, so that no place between two steps is left out.
  constexpr std::uint32_t most_places = 2 * maximum_shift_steps;
  const double step_m =
      std::max(2 * static_cast<double>(config.fit_distance_m), (most_m - least_m) / most_places);
  const auto places = static_cast<std::uint32_t>((most_m - least_m) / step_m) + 1;
  for (std::uint32_t k = 0; k < places; ++k) {
    const double shift_m = least_m + k * step_m;
    if (std::abs(shift_m) < same_m) continue;
    place(shift_m);
    std::uint32_t only_here = 0;
    std::uint32_t only_there = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const std::size_t m = i % model.size();
      const bool fits_there = is_fitting(model[m], points[i], body_from_data[m], config);
      if (fits_here[i] && !fits_there) ++only_here;
      if (!fits_here[i] && fits_there) ++only_there;
    }
    constexpr double sure = 2;  // standard deviations
    const double better = static_cast<double>(only_here) - only_there;
    if (better < sure * std::sqrt(static_cast<double>(only_here) + only_there) || better <= 0) return false;
  }
  return true;
}

}  // namespace alces
