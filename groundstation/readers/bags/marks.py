"""First bytes of bags, and the metadata of a ROS 2 bag: its file and how it begins."""

MCAP_MAGIC, ROS1_MAGIC, SQLITE_MAGIC = b"\x89MCAP0\r\n", b"#ROSBAG V2.0\n", b"SQLite format 3\0"
METADATA, METADATA_BEGINS = "metadata.yaml", b"rosbag2_bagfile_information:"
