#include <image_transport/simple_publisher_plugin.h>
#include <sensor_msgs/CompressedImage.h>

#include <pluginlib/class_list_macros.hpp>
#include <string>

namespace stand_in_transport {

/// Stands in for compressed_image_transport's publisher: the same name, the same topic; `format` shows which it is.
class CompressedPublisher : public image_transport::SimplePublisherPlugin<sensor_msgs::CompressedImage> {
 public:
  [[nodiscard]] std::string getTransportName() const override { return "compressed"; }

 protected:
  void publish(const sensor_msgs::Image& image, const PublishFn& publish_fn) const override {
    sensor_msgs::CompressedImage compressed;
    compressed.header = image.header;
    compressed.format = "stand-in";
    publish_fn(compressed);
  }
};

}  // namespace stand_in_transport

PLUGINLIB_EXPORT_CLASS(stand_in_transport::CompressedPublisher, image_transport::PublisherPlugin)
