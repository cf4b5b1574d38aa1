#include "pcl_match.h"

#include <pcl/pcl_config.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/registration/gicp.h>
#include <pcl/registration/icp.h>

#include <chrono>
#include <cmath>
#include <memory>

namespace alces::bench {
namespace {

using Cloud = pcl::PointCloud<pcl::PointXYZ>;
using Registration = pcl::Registration<pcl::PointXYZ, pcl::PointXYZ>;

Cloud::Ptr cloud_of(std::span<const Point> points) {
  auto cloud = std::make_shared<Cloud>();
  cloud->reserve(points.size());
  for (const Point& point : points) cloud->push_back({point.x, point.y, point.z});
  return cloud;
}

}  // namespace

PclMatch pcl_match(PclMethod method, std::span<const Point> model, std::span<const Point> data,
                   const Pose& model_from_data, double distance_limit_m, int iterations,
                   double translation_epsilon_m, double rotation_epsilon_rad) {
  const Cloud::Ptr target = cloud_of(model);
  const Cloud::Ptr source = cloud_of(data);
  const auto begin = std::chrono::steady_clock::now();
  std::unique_ptr<Registration> registration;
  if (method == PclMethod::icp) {
    registration = std::make_unique<pcl::IterativeClosestPoint<pcl::PointXYZ, pcl::PointXYZ>>();
    registration->setTransformationEpsilon(translation_epsilon_m * translation_epsilon_m);
    registration->setTransformationRotationEpsilon(std::cos(rotation_epsilon_rad));
  } else {
    registration = std::make_unique<pcl::GeneralizedIterativeClosestPoint<pcl::PointXYZ, pcl::PointXYZ>>();
  }
  registration->setMaxCorrespondenceDistance(distance_limit_m);
  registration->setMaximumIterations(iterations);
  registration->setInputTarget(target);
  registration->setInputSource(source);
  Cloud aligned;
  registration->align(aligned, model_from_data.matrix().cast<float>());
  PclMatch match;
  match.ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
  match.has_converged = registration->hasConverged();
  match.model_from_data = Pose::from_matrix(registration->getFinalTransformation().cast<double>());
  return match;
}

std::string pcl_version() {
  return PCL_VERSION_PRETTY;
}

}  // namespace alces::bench
