# After the power cut: what is on the disk?
mount -t ext4 /dev/vda /disk; verdict "power cut: the disk can be mounted" $? "ext4 refuses it"
ls -la /disk
cp /disk/cut.mcap "$out/cut.mcap"; verdict "power cut: the recording is there" $? "no cut.mcap"
umount /disk
