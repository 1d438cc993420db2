// Publishes raw BGR pictures that another program writes to its standard input, e.g. ffmpeg. No time comes with them:
// the stamp is the moment at which a picture is complete.
//
//   ffmpeg ... -f rawvideo -pix_fmt bgr24 - | bench_pipe_publisher TOPIC WIDTH HEIGHT

#include <cstdio>
#include <string>

#include <ros/ros.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/image_encodings.h>

int main(int argc, char** argv) {
  ros::init(argc, argv, "bench_pipe_publisher", ros::init_options::AnonymousName);
  if (argc != 4) {
    ROS_ERROR("usage: bench_pipe_publisher TOPIC WIDTH HEIGHT");
    return 2;
  }
  ros::NodeHandle handle;
  ros::Publisher publisher = handle.advertise<sensor_msgs::Image>(argv[1], 2);
  sensor_msgs::Image image;
  image.width = static_cast<std::uint32_t>(std::stoi(argv[2]));
  image.height = static_cast<std::uint32_t>(std::stoi(argv[3]));
  image.encoding = sensor_msgs::image_encodings::BGR8;
  image.step = image.width * 3;
  image.data.resize(std::size_t{image.step} * image.height);
  while (ros::ok() && std::fread(image.data.data(), image.data.size(), 1, stdin) == 1) {
    const ros::WallTime stamp = ros::WallTime::now();
    image.header.stamp = ros::Time(stamp.sec, stamp.nsec);
    publisher.publish(image);
  }
  return 0;
}
