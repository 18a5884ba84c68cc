"""The reference robot (KUKA KR16 R2010): published figures and the fit of its drive parameters to them."""
