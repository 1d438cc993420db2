// What a user writes first: reads the upper left part of the screen at a fixed rate with GetImage through the socket,
// turns it into BGR and publishes it. The stamp is the time before the request.
//
//   bench_get_image TOPIC WIDTH HEIGHT RATE

#include <xcb/xcb.h>

#include <cstdlib>
#include <memory>
#include <string>

#include <ros/ros.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/image_encodings.h>
#include <opencv2/imgproc.hpp>

int main(int argc, char** argv) {
  ros::init(argc, argv, "bench_get_image", ros::init_options::AnonymousName);
  if (argc != 5) {
    ROS_ERROR("usage: bench_get_image TOPIC WIDTH HEIGHT RATE");
    return 2;
  }
  const int width = std::stoi(argv[2]);
  const int height = std::stoi(argv[3]);
  ros::NodeHandle handle;
  ros::Publisher publisher = handle.advertise<sensor_msgs::Image>(argv[1], 2);
  xcb_connection_t* connection = xcb_connect(nullptr, nullptr);
  if (xcb_connection_has_error(connection) != 0) {
    ROS_ERROR("no X display");
    return 1;
  }
  const xcb_window_t root = xcb_setup_roots_iterator(xcb_get_setup(connection)).data->root;
  ros::WallRate rate(std::stod(argv[4]));
  while (ros::ok()) {
    const ros::WallTime stamp = ros::WallTime::now();
    const std::unique_ptr<xcb_get_image_reply_t, decltype(&std::free)> reply(
        xcb_get_image_reply(connection,
                            xcb_get_image(connection, XCB_IMAGE_FORMAT_Z_PIXMAP, root, 0, 0,
                                          static_cast<std::uint16_t>(width), static_cast<std::uint16_t>(height), ~0U),
                            nullptr),
        &std::free);
    if (!reply) {
      ROS_ERROR("the screen cannot be read");
      return 1;
    }
    sensor_msgs::Image image;
    image.header.stamp = ros::Time(stamp.sec, stamp.nsec);
    image.width = static_cast<std::uint32_t>(width);
    image.height = static_cast<std::uint32_t>(height);
    image.encoding = sensor_msgs::image_encodings::BGR8;
    image.step = image.width * 3;
    image.data.resize(std::size_t{image.step} * image.height);
    cv::Mat bgr(height, width, CV_8UC3, image.data.data());
    cv::cvtColor(cv::Mat(height, width, CV_8UC4, xcb_get_image_data(reply.get())), bgr, cv::COLOR_BGRA2BGR);
    publisher.publish(image);
    rate.sleep();
  }
  return 0;
}
