"""What moves the body: foot springs, legs, standing, and the walks they follow."""
