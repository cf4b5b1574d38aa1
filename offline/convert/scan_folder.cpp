#include "scan_folder.h"

#include <fmt/format.h>

#include <memory>
#include <string>
#include <string_view>

#include "cloud_writer.h"
#include "offline/io/files/staged_folder.h"
#include "offline/io/map_folder/trajectory.h"
#include "offline/io/scans/scan_source.h"

namespace alces::offline {
namespace {

bool is_scan_name(std::string_view name) {
  return name.ends_with(".pcd") || name == "odometry.tum";
}

}  // namespace

void write_scan_folder(const MapConversion& conversion, MapConversionReport& report,
                       const std::function<void(std::size_t, std::size_t)>& progress) {
  const std::unique_ptr<ScanSource> scans = open_scans(conversion.in, {.odometry = conversion.odometry,
                                                                       .no_odometry = conversion.no_odometry,
                                                                       .scale = conversion.scale,
                                                                       .format = conversion.scan_format,
                                                                       .bag = conversion.bag});
  StagedFolder stage(conversion.out, is_scan_name);
  Trajectory odometry;
  odometry.has_time = true;
  ScanPoints scan;
  for (std::size_t i = 0; i < scans->size() && scans->read(i, scan); ++i) {
    const std::optional<double> stamp_s = scans->stamp_s(i);
    const std::string name =
        stamp_s ? fmt::format("{:.9f}.pcd", *stamp_s) : fmt::format("{:06}.pcd", scans->number(i));
    const std::unique_ptr<CloudWriter> writer =
        open_cloud_writer(stage.staging() / name, CloudForm::pcd, scans->origin_m());
    writer->add(scan.points, static_cast<std::uint32_t>(scans->number(i)), stamp_s.value_or(0));
    report.points += writer->written();
    report.not_finite += writer->not_finite();
    writer->finish();
    if (const std::optional<Pose> pose = scans->odometry(i)) {
      odometry.poses.push_back(*pose);
      odometry.stamps_s.push_back(stamp_s.value_or(static_cast<double>(scans->number(i))));
      odometry.has_time = odometry.has_time && stamp_s;
    }
    ++report.scans;
    if (progress) progress(i + 1, scans->size());
  }
  if (odometry.size() > 0) write_tum(stage.staging() / "odometry.tum", odometry);
  stage.commit();
  report.warnings = scans->warnings();
}

}  // namespace alces::offline
