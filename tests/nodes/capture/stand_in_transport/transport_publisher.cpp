#include <image_transport/image_transport.h>
#include <ros/ros.h>

/// What any camera driver does: advertises camera/image_raw through image_transport, and publishes it.
int main(int argc, char** argv) {
  ros::init(argc, argv, "transport_publisher");
  ros::NodeHandle handle;
  image_transport::ImageTransport transport(handle);
  const image_transport::Publisher publisher = transport.advertise("camera/image_raw", 1);
  sensor_msgs::Image image;
  image.width = image.height = 1;
  image.encoding = "mono8";
  image.step = 1;
  image.data = {0};
  const ros::WallDuration pause(0.05);
  while (ros::ok()) {
    publisher.publish(image);
    pause.sleep();
  }
  return 0;
}
